#include "crops.h"

#include <algorithm>

#include "nadir/record/image_files.h"

namespace nadir::bench {
namespace {

constexpr int times = 4, bands = 3;

struct Part {
  int x, y, width, height;
};
/// From the upper half, where oblique views shrink the map most.
Part part_of(const View& view) {
  const int width = std::min(90, view.width), height = std::min(67, view.height);
  return {(view.width - width) / 2, (view.height - height) / 4, width, height};
}

/// Pixels of the part, each as a square of several.
std::vector<std::byte> enlarged(const Part& part, const std::vector<std::byte>& pixels) {
  std::vector<std::byte> out;
  for (int y = 0; y < part.height * times; ++y)
    for (int x = 0; x < part.width * times; ++x)
      for (int band = 0; band < bands; ++band)
        out.push_back(pixels[static_cast<std::size_t>((y / times * part.width + x / times) * bands + band)]);
  return out;
}

}  // namespace

void Crops::add(const std::string& caption, const std::string& frame) {
  const Part part = part_of(setting_->view);
  std::vector<std::byte> pixels;
  for (const std::size_t pixel : rectangle(setting_->view, part.x, part.y, part.width, part.height))
    for (std::size_t band = 0; band < bands; ++band)
      pixels.push_back(static_cast<std::byte>(frame[pixel * bands + band]));
  pictures_.emplace_back(caption, enlarged(part, pixels));
}

Result<void> Crops::write(const std::filesystem::path& path, const std::string& title) const {
  const auto files = record::image_files();
  if (!files) return fail(files);
  const Part part = part_of(setting_->view);
  const Ideal ideal = ideal_of(setting_->view, setting_->scenery->content(),
                               rectangle(setting_->view, part.x, part.y, part.width, part.height));
  std::vector<std::byte> pixels;
  for (const double value : ideal.image) pixels.push_back(static_cast<std::byte>(value));
  auto pictures = pictures_;
  pictures.insert(pictures.begin(), {"ideal", enlarged(part, pixels)});
  record::ContactSheet sheet{title, {}};
  for (const auto& [caption, samples] : pictures)
    sheet.frames.push_back(
        {.image = {samples.data(), tile::SampleType::UInt8, part.width * times, part.height * times, bands},
         .caption = caption});
  const auto written = (*files)->write_contact_sheet(path, sheet);
  if (!written) return fail(written);
  return {};
}

}  // namespace nadir::bench
