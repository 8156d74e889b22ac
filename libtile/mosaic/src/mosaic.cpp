#include "nadir/mosaic/mosaic.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>

namespace nadir::mosaic {
namespace {

bool meet(const Window& a, const Window& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

bool contains(const Window& outer, const Window& inner) {
  return outer.x <= inner.x && outer.y <= inner.y && inner.x + inner.width <= outer.x + outer.width &&
         inner.y + inner.height <= outer.y + outer.height;
}

Result<std::vector<Grid>> grids_of(const Sources& sources) {
  std::map<std::string, geodesy::Projection> projections;
  std::vector<Grid> grids;
  for (const auto& source : sources.rasters) {
    const auto& georeference = source->description().georeference;
    if (!georeference)
      return fail(Error::Kind::Malformed, fmt::format("{}: expected a georeferenced raster, found {}", source->label(),
                                                      source->description().georeference_problem));
    auto found = projections.find(georeference->definition);
    if (found == projections.end()) {
      auto projection = geodesy::Projection::from_definition(georeference->definition);
      if (!projection)
        return fail(projection.error().kind, fmt::format("{}: {}", source->label(), projection.error().message));
      found = projections.emplace(georeference->definition, std::move(*projection)).first;
    }
    grids.push_back(
        {found->second, georeference->definition, georeference->crs_from_texel, source->width(), source->height()});
  }
  return grids;
}

/// Ground control points alone place a raster, if roughly; nothing can be laid beside it then.
bool has_control_points_only(const Source& source) {
  return !source.description().georeference &&
         source.description().georeference_problem.find("control points") != std::string::npos;
}

}  // namespace

Result<Mosaic> Mosaic::lay_out(Sources sources, const MosaicOptions& options) {
  Mosaic mosaic;
  mosaic.type_ = sources.type;
  mosaic.warnings_ = sources.warnings;
  mosaic.sources_ = std::move(sources);
  const auto& rasters = mosaic.sources_.rasters;
  const bool stays = options.grid.crs.empty() && !options.grid.gsd && !options.grid.extent;
  if (rasters.size() == 1 && stays && has_control_points_only(*rasters.front())) {
    mosaic.width_ = static_cast<std::int32_t>(rasters.front()->width());
    mosaic.height_ = static_cast<std::int32_t>(rasters.front()->height());
    mosaic.layers_.push_back({rasters.front(), std::nullopt, {0, 0, mosaic.width_, mosaic.height_}});
    mosaic.warnings_.push_back(fmt::format("{}: {}; the map keeps them, and needs to be warped before it is rendered",
                                           rasters.front()->label(),
                                           rasters.front()->description().georeference_problem));
    return mosaic;
  }
  if (const auto ok = mosaic.lay_onto_grid(options); !ok) return fail(ok);
  const bool tells_holes = mosaic.type_.mask || mosaic.type_.alpha || mosaic.type_.nodata;
  if (!tells_holes && !mosaic.is_covered()) mosaic.type_.mask = true;
  return mosaic;
}

Result<void> Mosaic::lay_onto_grid(const MosaicOptions& options) {
  const auto grids = grids_of(sources_);
  if (!grids) return fail(grids);
  std::vector<std::string> labels;
  for (const auto& source : sources_.rasters) labels.push_back(source->label());
  auto grid = common_grid(*grids, labels, options.grid);
  if (!grid) return fail(grid);
  if (std::max(grid->width, grid->height) > std::numeric_limits<std::int32_t>::max())
    return fail(Error::Kind::Unsupported,
                fmt::format("{}: the map would have {} x {} texels, more than a raster can; choose a greater --gsd or "
                            "an --extent",
                            labels.front(), grid->width, grid->height));
  width_ = static_cast<std::int32_t>(grid->width);
  height_ = static_cast<std::int32_t>(grid->height);
  for (std::size_t i = 0; i < grids->size(); ++i) {
    auto placement = Placement::create(*grid, (*grids)[i], options.placement);
    if (!placement) return fail(placement.error().kind, fmt::format("{}: {}", labels[i], placement.error().message));
    const Window covered = placement->covered();
    layers_.push_back({sources_.rasters[i], std::move(*placement), covered});
  }
  if (std::all_of(layers_.begin(), layers_.end(), [](const Layer& l) { return l.covered.width == 0; }))
    return fail(Error::Kind::NotFound,
                fmt::format("{}: no source reaches into the extent asked for; give it in units of the map's CRS",
                            labels.front()));
  grid_ = std::move(*grid);
  return {};
}

bool Mosaic::is_covered() const {
  const Window all{0, 0, width_, height_};
  const auto copied = [](const Layer& l) { return !l.placement || l.placement->shift(); };
  if (std::any_of(layers_.begin(), layers_.end(),
                  [&](const Layer& l) { return copied(l) && contains(l.covered, all); }))
    return true;
  // The corners of what is copied divide the map into rectangles: each is covered by one of them, or not at all.
  std::vector<std::int32_t> xs = {0, width_}, ys = {0, height_};
  std::vector<Window> windows;
  for (const Layer& layer : layers_) {
    if (!copied(layer) || layer.covered.width == 0) continue;
    const Window& w = layer.covered;
    xs.insert(xs.end(), {w.x, w.x + w.width});
    ys.insert(ys.end(), {w.y, w.y + w.height});
    windows.push_back(w);
  }
  for (auto* cuts : {&xs, &ys}) {
    std::sort(cuts->begin(), cuts->end());
    cuts->erase(std::unique(cuts->begin(), cuts->end()), cuts->end());
  }
  for (std::size_t row = 0; row + 1 < ys.size(); ++row) {
    std::vector<Window> in_row;
    const Window strip{0, ys[row], width_, ys[row + 1] - ys[row]};
    std::copy_if(windows.begin(), windows.end(), std::back_inserter(in_row),
                 [&](const Window& w) { return meet(w, strip); });
    std::sort(in_row.begin(), in_row.end(), [](const Window& a, const Window& b) { return a.x < b.x; });
    std::int32_t reached = 0;
    for (const Window& w : in_row)
      if (w.x <= reached) reached = std::max(reached, w.x + w.width);
    if (reached < width_) return false;
  }
  return true;
}

bool Mosaic::reaches(const Window& window) const {
  return std::any_of(layers_.begin(), layers_.end(), [&](const Layer& l) { return meet(l.covered, window); });
}

Result<void> Mosaic::read(Block& to) const {
  const Window window = to.window();
  const bool opaque = !sources_.type.mask && !sources_.type.alpha && !sources_.type.nodata &&
                      sources_.type.sample != Sample::F32 && sources_.type.sample != Sample::F64;
  std::vector<const Layer*> here;
  for (const Layer& layer : layers_) {
    if (!meet(layer.covered, window)) continue;
    const bool copied = !layer.placement || layer.placement->shift();
    if (opaque && copied && contains(layer.covered, window)) here.clear();  // hides what lies below
    here.push_back(&layer);
  }

  // One source alone, texel for texel, is read where it shall lie.
  if (here.size() == 1 && contains(here.front()->covered, window) && to.masked() == sources_.type.mask) {
    const Layer& layer = *here.front();
    const auto shift = layer.placement ? layer.placement->shift() : std::array<std::int64_t, 2>{0, 0};
    if (shift) {
      const auto x = static_cast<std::int32_t>((*shift)[0]), y = static_cast<std::int32_t>((*shift)[1]);
      to.move_by(-x, -y);
      auto done = layer.source->read(to);
      to.move_by(x, y);
      return done;
    }
  }

  clear(type_, to);
  static thread_local Block piece;
  for (const Layer* layer : here) {
    const Window needed = layer->placement->needed(window);
    if (needed.width == 0) continue;
    piece.reset(sources_.type, needed);
    if (const auto ok = layer->source->read(piece); !ok) return ok;
    layer->placement->resample(type_, piece, to);
  }
  return {};
}

}  // namespace nadir::mosaic
