#include "agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "band_choice.h"
#include "sample_types.h"

namespace nadir::mosaic {
namespace {

/// What one raster says of itself, for the bands that are taken.
struct Facts {
  Sample data = Sample::U8;                // holds all data bands
  bool complex = false, whole_64 = false;  // some integers of 64 bits
  bool nodata = false;                     // some band has it
  bool nodata_by_band = false;             // not all the same
  std::optional<double> common_nodata;     // of all bands
};

const BandHeader& band_of(const RasterHeader& header, const Channel& channel) {
  return header.bands[static_cast<std::size_t>(channel.band)];
}

Sample sample_of(const RasterHeader& header, const Channel& channel) {
  return channel.color >= 0 ? Sample::U8 : band_of(header, channel).sample;
}

Result<Facts> facts_of(const RasterHeader& header, const Bands& bands) {
  Facts facts;
  facts.data = sample_of(header, bands.data.front().channel);
  const auto& nodata = band_of(header, bands.data.front().channel).nodata;
  for (const Candidate& candidate : bands.data) {
    const BandHeader& band = band_of(header, candidate.channel);
    const Sample sample = sample_of(header, candidate.channel);
    facts.data = common_type(facts.data, sample);
    facts.complex = facts.complex || band.complex;
    facts.whole_64 = facts.whole_64 || sample == Sample::U64 || sample == Sample::I64;
    facts.nodata = facts.nodata || band.nodata;
    facts.nodata_by_band = facts.nodata_by_band || !same_nodata(band.nodata, nodata);
    if (facts.nodata_by_band && !is_float(sample))
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: bands {} and {} have different nodata values, and a GeoTIFF holds one; choose among "
                              "them with --bands, or make them agree with gdal_translate -a_nodata",
                              header.file.label, bands.data.front().channel.band + 1, candidate.channel.band + 1));
  }
  if (!facts.nodata_by_band) facts.common_nodata = nodata;
  return facts;
}

/// The type of all; what it cannot hold is told.
Sample common_sample(std::span<const RasterHeader> headers, const std::vector<Facts>& facts,
                     std::vector<std::string>& warnings) {
  Sample sample = facts.front().data;
  bool whole_64 = false;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    sample = common_type(sample, facts[i].data);
    whole_64 = whole_64 || facts[i].whole_64;
    if (facts[i].complex)
      warnings.push_back(fmt::format("{}: its complex samples become their magnitudes, of type {}",
                                     headers[i].file.label, to_string(facts[i].data)));
  }
  if (whole_64 && is_float(sample))
    warnings.push_back(
        fmt::format("{}: integers of 64 bits become Float64, exact to 53 bits, since the sources have no "
                    "integer type in common",
                    headers.front().file.label));
  return sample;
}

/// Where validity lies: alpha, else mask, else nodata.
void choose_validity(std::span<const RasterHeader> headers, const std::vector<Bands>& bands,
                     const std::vector<Facts>& facts, const SourceOptions& options, TexelType& type) {
  const auto any = [&](auto&& what) {
    for (std::size_t i = 0; i < headers.size(); ++i)
      if (what(i)) return true;
    return false;
  };
  const bool alpha = any([&](std::size_t i) { return bands[i].alpha.has_value(); });
  const bool mask = any([&](std::size_t i) { return headers[i].masked; });
  const bool nodata = any([&](std::size_t i) { return facts[i].nodata; });
  const bool one_nodata = !any([&](std::size_t i) {
    return !facts[i].common_nodata || !same_nodata(facts[i].common_nodata, facts.front().common_nodata) ||
           bands[i].data.front().channel.color >= 0;  // an index, of which colours remain
  });
  type.alpha = alpha && !options.alpha_to_mask;
  type.mask = !type.alpha && (mask || alpha || (nodata && options.nodata_to_mask));
  if (type.mask || !nodata || mask || options.nodata_to_mask) return;
  if (one_nodata)
    type.nodata = facts.front().common_nodata;
  else if (is_float(type.sample))
    type.nodata = std::numeric_limits<double>::quiet_NaN();
  else
    type.mask = !type.alpha;
}

BandProperties properties_of(const RasterHeader& header, const Candidate& candidate) {
  BandProperties properties;
  properties.name = candidate.name;
  properties.color = candidate.color;
  if (candidate.channel.color >= 0) return properties;
  const tile::Band& band = header.description.bands[static_cast<std::size_t>(candidate.channel.band)];
  properties.unit = band.unit;
  properties.scale = band.scale;
  properties.offset = band.offset;
  properties.metadata = band_of(header, candidate.channel).metadata;
  properties.categories = band_of(header, candidate.channel).categories;
  return properties;
}

/// Stored values of different scales in one band would be a plausible wrong map.
Result<void> check_scales(std::span<const RasterHeader> headers, const std::vector<Bands>& bands,
                          const std::vector<BandProperties>& properties, std::size_t reference) {
  for (std::size_t i = 0; i < headers.size(); ++i)
    for (std::size_t b = 0; b < bands[i].data.size(); ++b) {
      const Channel& channel = bands[i].data[b].channel;
      if (channel.color >= 0) continue;
      const tile::Band& band = headers[i].description.bands[static_cast<std::size_t>(channel.band)];
      if (band.scale == properties[b].scale && band.offset == properties[b].offset) continue;
      return fail(Error::Kind::Unsupported,
                  fmt::format("{}: band {} has scale {} and offset {}, in {} it has {} and {}; make them agree with "
                              "gdal_translate -unscale -ot Float32",
                              headers[i].file.label, channel.band + 1, band.scale, band.offset,
                              headers[reference].file.label, properties[b].scale, properties[b].offset));
    }
  return {};
}

Metadata common_metadata(std::span<const RasterHeader> headers) {
  Metadata common = headers.front().metadata;
  for (const RasterHeader& header : headers.subspan(1))
    std::erase_if(common, [&](const auto& item) {
      return std::find(header.metadata.begin(), header.metadata.end(), item) == header.metadata.end();
    });
  return common;
}

std::vector<std::uint16_t> stored_palette(const BandHeader& band) {
  const std::size_t entries = std::size_t{1} << (8 * tiff::size_bytes(band.sample));
  std::vector<std::uint16_t> palette(3 * entries);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < std::min(entries, band.palette.size()); ++i)
      palette[c * entries + i] = static_cast<std::uint16_t>(band.palette[i][c] * 257);
  return palette;
}

Reading reading_of(const RasterHeader& header, const Bands& bands, const TexelType& type) {
  Reading reading;
  reading.rule.to = type;
  reading.rule.masked = header.masked;
  std::vector<Channel> channels;
  for (const Candidate& candidate : bands.data) channels.push_back(candidate.channel);
  if (bands.alpha) channels.push_back(*bands.alpha);
  for (const Channel& channel : channels) reading.bands.push_back(channel.band);
  std::sort(reading.bands.begin(), reading.bands.end());
  reading.bands.erase(std::unique(reading.bands.begin(), reading.bands.end()), reading.bands.end());
  reading.rule.pitch = static_cast<int>(reading.bands.size());

  reading.rule.stored = header.bands[static_cast<std::size_t>(reading.bands.front())].sample;
  for (const int band : reading.bands)
    reading.rule.stored = common_type(reading.rule.stored, header.bands[static_cast<std::size_t>(band)].sample);
  const auto among_read = [&](Channel channel) {
    const auto it = std::lower_bound(reading.bands.begin(), reading.bands.end(), channel.band);
    return Channel{static_cast<int>(it - reading.bands.begin()), channel.color};
  };
  for (const Candidate& candidate : bands.data) {
    const BandHeader& band = band_of(header, candidate.channel);
    reading.rule.data.push_back(among_read(candidate.channel));
    reading.rule.nodata.push_back(band.nodata);
    if (candidate.channel.color >= 0) reading.rule.palette = band.palette;
  }
  if (bands.alpha) {
    reading.rule.alpha = among_read(*bands.alpha);
    reading.rule.alpha_stored = sample_of(header, *bands.alpha);
  }
  return reading;
}

}  // namespace

Result<Agreement> agree(std::span<const RasterHeader> headers, const SourceOptions& options) {
  Agreement agreement;
  Sources& map = agreement.map;
  bool palettes_kept = false;
  auto bands = choose_bands(headers, options, palettes_kept);
  if (!bands) return fail(bands);
  const auto reference = match_bands(headers, *bands, map.warnings);
  if (!reference) return fail(reference);

  std::vector<Facts> facts;
  for (std::size_t i = 0; i < headers.size(); ++i) {
    auto found = facts_of(headers[i], (*bands)[i]);
    if (!found) return fail(found);
    facts.push_back(*found);
  }
  map.type.sample = common_sample(headers, facts, map.warnings);
  choose_validity(headers, *bands, facts, options, map.type);
  map.type.bands = static_cast<int>((*bands)[*reference].data.size()) + (map.type.alpha ? 1 : 0);

  for (const Candidate& candidate : (*bands)[*reference].data)
    map.bands.push_back(properties_of(headers[*reference], candidate));
  if (auto ok = check_scales(headers, *bands, map.bands, *reference); !ok) return fail(ok);
  if (map.type.alpha) map.bands.push_back({"", "Alpha", "", 1, 0, {}, {}});
  if (palettes_kept) map.palette = stored_palette(band_of(headers.front(), bands->front().data.front().channel));
  map.metadata = common_metadata(headers);
  map.pixel_is_point = headers.front().pixel_is_point;
  for (std::size_t i = 0; i < headers.size(); ++i)
    agreement.readings.push_back(reading_of(headers[i], (*bands)[i], map.type));
  return agreement;
}

}  // namespace nadir::mosaic
