#pragma once

#include <optional>
#include <string_view>

#include "nadir/tiff/sample.h"

namespace nadir::mosaic {

using tiff::Sample;

/// How samples of the type that GDAL calls `stored_type` are held: complex ones as their magnitude. Empty where GDAL
/// has grown a type that we do not know.
std::optional<Sample> sample_of(std::string_view stored_type);
bool is_complex(std::string_view stored_type);
bool is_float(Sample sample);
std::string_view to_string(Sample sample);  // as GDAL names it: "UInt16"

/// The smallest type that holds all values of both: F64 where none does (U64 beside I64) and for 32-bit integers of
/// both signs, since few readers know integers of 64 bits.
Sample common_type(Sample a, Sample b);

/// The value that a sample compares equal to where it is nodata: a double just beyond a float's range is clamped, as
/// some writers note one. Empty where the type can never hold it.
std::optional<double> nodata_held(Sample sample, double nodata);

/// Whether two nodata values are the same; all NaN are.
bool same_nodata(const std::optional<double>& a, const std::optional<double>& b);

/// Opacity of what is opaque: the type's largest value; of floats 1.
double opaque(Sample sample);

}  // namespace nadir::mosaic
