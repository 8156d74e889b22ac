#include "band_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

namespace nadir::mosaic {
namespace {

constexpr std::array<const char*, 3> rgb = {"Red", "Green", "Blue"};

/// The number, from 0, of a raster's alpha band.
Result<std::optional<int>> alpha_of(const RasterHeader& header) {
  std::optional<int> alpha;
  const auto& bands = header.description.bands;
  for (int b = 0; b < static_cast<int>(bands.size()); ++b) {
    if (bands[static_cast<std::size_t>(b)].color != "Alpha") continue;
    if (alpha)
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: expected one alpha band at most, found more; choose bands that are none with "
                              "gdal_translate -b",
                              header.file.label));
    alpha = b;
  }
  return alpha;
}

/// The bands, from 0, that `names` mean in a raster; names that the first has and this has not are taken as the
/// numbers that they mean in the first.
Result<std::vector<int>> numbers_of(const RasterHeader& first, const RasterHeader& header,
                                    const std::vector<std::string>& names) {
  std::vector<int> numbers;
  const auto& bands = header.description.bands;
  if (names.empty())
    for (int b = 0; b < static_cast<int>(bands.size()); ++b) numbers.push_back(b);
  for (const std::string& name : names) {
    const auto in_first = first.description.find_band(name);
    if (!in_first) return fail(in_first);
    const std::string& called = first.description.bands[static_cast<std::size_t>(*in_first) - 1].name;
    const auto it = std::find_if(bands.begin(), bands.end(),
                                 [&](const tile::Band& b) { return !called.empty() && b.name == called; });
    const int number = it != bands.end() ? static_cast<int>(it - bands.begin()) : *in_first - 1;
    if (number >= static_cast<int>(bands.size()))
      return fail(Error::Kind::NotFound,
                  fmt::format("{}: no band {}, which is '{}' in {}: it has bands 1 to {}", header.file.label,
                              number + 1, name, first.file.label, bands.size()));
    numbers.push_back(number);
  }
  return numbers;
}

/// Whether some index of a palette is seen through, other than the one that is nodata.
bool is_translucent(const BandHeader& band) {
  for (std::size_t i = 0; i < band.palette.size(); ++i)
    if (band.palette[i][3] != 255 && band.nodata != static_cast<double>(i)) return true;
  return false;
}

/// The colours that a band of indices stands for.
Bands expanded(const RasterHeader& header, int band, std::optional<Channel> alpha) {
  Bands bands;
  for (int c = 0; c < 3; ++c) bands.data.push_back({{band, c}, "", rgb[static_cast<std::size_t>(c)]});
  bands.alpha = alpha;
  if (!alpha && is_translucent(header.bands[static_cast<std::size_t>(band)])) bands.alpha = Channel{band, 3};
  return bands;
}

bool has_colors(const Bands& bands) {
  return std::all_of(rgb.begin(), rgb.end(), [&](const char* color) {
    return std::any_of(bands.data.begin(), bands.data.end(), [&](const Candidate& c) { return c.color == color; });
  });
}

bool is_grey(const Bands& bands) {
  return bands.data.size() == 1 && (bands.data[0].color == "Gray" || bands.data[0].color == "Undefined");
}

/// `bands` in the order in which `wanted` has the same keys; empty where the keys do not tell.
std::vector<Candidate> by_key(const Bands& wanted, const Bands& bands, std::string Candidate::*key) {
  std::vector<Candidate> found;
  std::set<std::string> seen;
  for (const Candidate& want : wanted.data) {
    const std::string& value = want.*key;
    if (value.empty() || value == "Undefined" || value == "Gray" || !seen.insert(value).second) return {};
    const auto same = [&](const Candidate& c) { return c.*key == value; };
    if (std::count_if(bands.data.begin(), bands.data.end(), same) != 1) return {};
    found.push_back(*std::find_if(bands.data.begin(), bands.data.end(), same));
  }
  return found;
}

std::string list(const Bands& bands) {
  std::string text = fmt::format("{} band{} (", bands.data.size(), bands.data.size() == 1 ? "" : "s");
  for (std::size_t i = 0; i < bands.data.size() && i < 8; ++i)
    text += (i ? ", " : "") + (bands.data[i].name.empty() ? bands.data[i].color : bands.data[i].name);
  return text + (bands.data.size() > 8 ? ", ...)" : ")");
}

}  // namespace

Result<std::vector<Bands>> choose_bands(std::span<const RasterHeader> headers, const SourceOptions& options,
                                        bool& keep_palettes) {
  std::vector<std::vector<int>> chosen;
  std::vector<std::optional<Channel>> alphas;
  for (const RasterHeader& header : headers) {
    const auto alpha = alpha_of(header);
    if (!alpha) return fail(alpha);
    auto numbers = numbers_of(headers.front(), header, options.bands);
    if (!numbers) return fail(numbers);
    if (*alpha) std::erase(*numbers, **alpha);
    if (numbers->empty())
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: expected a band of data, found alpha only", header.file.label));
    chosen.push_back(std::move(*numbers));
    alphas.push_back(*alpha ? std::optional(Channel{**alpha, -1}) : std::nullopt);
  }

  // Indices stay indices where they mean the same everywhere
  const auto indexed = [&](std::size_t i) -> const BandHeader* {
    if (chosen[i].size() != 1) return nullptr;
    const BandHeader& band = headers[i].bands[static_cast<std::size_t>(chosen[i].front())];
    return band.palette.empty() ? nullptr : &band;
  };
  const BandHeader* first = indexed(0);
  keep_palettes = first && !options.expand_palettes;
  for (std::size_t i = 0; i < headers.size() && keep_palettes; ++i) {
    const BandHeader* band = indexed(i);
    keep_palettes = band && band->palette == first->palette && !is_translucent(*band) && !alphas[i] &&
                    (band->sample == Sample::U8 || band->sample == Sample::U16) && band->sample == first->sample;
  }

  std::vector<Bands> all;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    if (indexed(i) && !keep_palettes) {
      all.push_back(expanded(headers[i], chosen[i].front(), alphas[i]));
      continue;
    }
    Bands bands;
    for (const int number : chosen[i]) {
      const tile::Band& band = headers[i].description.bands[static_cast<std::size_t>(number)];
      bands.data.push_back({{number, -1}, band.name, band.color});
    }
    bands.alpha = alphas[i];
    all.push_back(std::move(bands));
  }
  return all;
}

Result<std::size_t> match_bands(std::span<const RasterHeader> headers, std::vector<Bands>& bands,
                                std::vector<std::string>& warnings) {
  std::size_t reference = 0;
  if (is_grey(bands.front()))
    for (std::size_t i = 0; i < bands.size() && reference == 0; ++i)
      if (has_colors(bands[i])) reference = i;
  const Bands wanted = bands[reference];
  const bool colors = has_colors(wanted) && wanted.data.size() == 3;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    if (i == reference) continue;
    std::vector<Candidate> found = by_key(wanted, bands[i], &Candidate::name);
    if (found.empty()) found = by_key(wanted, bands[i], &Candidate::color);
    if (found.empty() && bands[i].data.size() == wanted.data.size()) found = bands[i].data;
    if (found.empty() && colors && is_grey(bands[i])) found.assign(3, bands[i].data.front());
    if (found.empty())
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: it has {}, and {} has {}, which do not belong together; choose among them with "
                              "--bands",
                              headers[i].file.label, list(bands[i]), headers[reference].file.label, list(wanted)));
    if (bands[i].data.size() > found.size())
      warnings.push_back(fmt::format("{}: of its {} those that {} has not are left out", headers[i].file.label,
                                     list(bands[i]), headers[reference].file.label));
    bands[i].data = std::move(found);
  }
  return reference;
}

}  // namespace nadir::mosaic
