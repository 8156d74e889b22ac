#include "design.h"

#include <algorithm>

namespace nadir::pyramid {

Result<Design> design(const BuildOptions& options) {
  mosaic::SourceOptions wanted;
  wanted.names = options.sources;
  wanted.bands = options.bands;
  wanted.zoom = options.zoom;
  wanted.overlap = options.overlap;
  wanted.alpha_to_mask = options.compression == Compression::Jpeg;
  wanted.nodata_to_mask = is_lossy(options);
  wanted.cache_bytes = options.memory_bytes / 4;
  auto sources = mosaic::open_sources(wanted);
  if (!sources) return fail(sources);

  std::vector<std::string> warnings;
  const auto role = choose_role(options, *sources);
  auto reduction = choose_reduction(options, role, *sources, warnings);
  if (!reduction) return fail(reduction);
  mosaic::MosaicOptions layout;
  layout.grid = options.grid;
  const bool blends = reduction->filter != Filter::Mode && reduction->filter != Filter::Nearest;
  layout.placement.interpolation =
      options.interpolation.value_or(blends ? mosaic::Interpolation::Bilinear : mosaic::Interpolation::Nearest);
  layout.placement.tolerance_texels = options.tolerance_texels;
  layout.placement.power = reduction->power;
  if (reduction->power) {
    layout.placement.scale = reduction->scale.front();
    layout.placement.offset = reduction->offset.front();
  }
  auto mosaic = mosaic::Mosaic::lay_out(std::move(*sources), layout);
  if (!mosaic) return fail(mosaic);
  warnings.insert(warnings.begin(), mosaic->warnings().begin(), mosaic->warnings().end());
  auto codec = choose_codec(options, role, mosaic->sources(), mosaic->type());
  if (!codec) return fail(codec);
  return Design{std::move(*mosaic), role, std::move(*reduction), std::move(*codec), std::move(warnings)};
}

Result<TilePacker> make_packer(const Design& design, const BuildOptions& options) {
  auto imagery = tiff::TileEncoder::create(design.codec.imagery, design.codec.packing);
  if (!imagery) return fail(imagery);
  std::optional<tiff::TileEncoder> mask;
  if (design.codec.mask) {
    auto encoder = tiff::TileEncoder::create(*design.codec.mask, {});
    if (!encoder) return fail(encoder);
    mask = std::move(*encoder);
  }
  return TilePacker(design.mosaic.type(), options.tile_size, std::move(*imagery), std::move(mask));
}

}  // namespace nadir::pyramid
