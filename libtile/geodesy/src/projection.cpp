#include "nadir/geodesy/projection.h"

#include <fmt/format.h>

#include <atomic>
#include <charconv>
#include <cmath>
#include <limits>

#include "closed_form.h"
#include "nadir/geodesy/crs_module.h"

namespace nadir::geodesy {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// 32614 of "EPSG:32614".
std::optional<int> epsg_code(std::string_view definition) {
  if (!definition.starts_with("EPSG:")) return std::nullopt;
  definition.remove_prefix(5);
  int code = 0;
  const auto [end, error] = std::from_chars(definition.data(), definition.data() + definition.size(), code);
  return error == std::errc() && end == definition.data() + definition.size() ? std::optional(code) : std::nullopt;
}

}  // namespace

struct Projection::Shared {
  std::string name, identity, datum;          // identity: equal where the CRS is the same
  std::shared_ptr<const ClosedForm> closed;   // else
  std::shared_ptr<const LibraryCrs> library;  // this
  std::optional<double> turn;
  std::atomic<std::int64_t> points{0};
};

Result<Projection> Projection::from_definition(const std::string& definition) {
  auto shared = std::make_shared<Shared>();
  const auto close = [&](int code) {
    shared->closed = closed_form(code);
    if (!shared->closed) return false;
    shared->identity = fmt::format("EPSG:{}", code);
    shared->turn = shared->closed->turn();
    return true;
  };
  if (const auto code = epsg_code(definition); code && close(*code)) {
    shared->name = definition;
    shared->datum = "World Geodetic System 1984 ensemble";
    return Projection(std::move(shared));
  }

  const auto module = crs_module();
  if (!module)
    return fail(module.error().kind, fmt::format("CRS '{}': {}", definition.substr(0, 80), module.error().message));
  auto crs = (*module)->open(definition);
  if (!crs) return fail(crs);
  shared->name = (*crs)->name;
  shared->datum = (*crs)->datum;
  if ((*crs)->same_as && close(*(*crs)->same_as)) return Projection(std::move(shared));
  shared->identity = (*crs)->wkt;
  if ((*crs)->geographic) shared->turn = 360 / (*crs)->degrees_per_unit;
  shared->library = std::move(*crs);
  return Projection(std::move(shared));
}

const std::string& Projection::name() const { return shared_->name; }
const std::string& Projection::datum() const { return shared_->datum; }
bool Projection::uses_library() const { return shared_->library != nullptr; }
std::optional<double> Projection::turn() const { return shared_->turn; }
void Projection::wrap_around(double x) { wrap_x_ = shared_->turn ? std::optional(x) : std::nullopt; }
std::int64_t Projection::library_points() const { return shared_->points.load(std::memory_order_relaxed); }

Result<std::string> Projection::wkt() const {
  if (shared_->library) return shared_->library->wkt;
  const auto module = crs_module();
  if (!module) return fail(module);
  const auto crs = (*module)->open(shared_->identity);
  if (!crs) return fail(crs);
  return (*crs)->wkt;
}

bool operator==(const Projection& a, const Projection& b) {
  return (a.shared_ == b.shared_ || a.shared_->identity == b.shared_->identity) && a.wrap_x_ == b.wrap_x_;
}

void Projection::crs_from_lon_lat(std::span<Eigen::Vector2d> points) const {
  if (shared_->closed) {
    shared_->closed->forward(points);
  } else {
    for (auto& p : points) p = {to_degrees(p.x()), to_degrees(p.y())};
    shared_->library->transform(LibraryCrs::Direction::Into, points);
    shared_->points.fetch_add(static_cast<std::int64_t>(points.size()), std::memory_order_relaxed);
  }
  if (wrap_x_)
    for (auto& p : points) p.x() -= *turn() * std::round((p.x() - *wrap_x_) / *turn());
}

void Projection::lon_lat_from_crs(std::span<Eigen::Vector2d> points) const {
  if (shared_->closed) {
    shared_->closed->inverse(points);
  } else {
    shared_->library->transform(LibraryCrs::Direction::OutOf, points);
    shared_->points.fetch_add(static_cast<std::int64_t>(points.size()), std::memory_order_relaxed);
    for (auto& p : points) p = {to_radians(p.x()), to_radians(p.y())};
  }
  for (auto& p : points) {
    if (!(std::abs(p.y()) <= to_radians(90))) p = {nan, nan};
    p.x() = std::remainder(p.x(), to_radians(360));
  }
}

bool has_closed_form(int code) { return closed_form(code) != nullptr; }

}  // namespace nadir::geodesy
