#pragma once

#include <string>

#include "nadir/record/report.h"

namespace nadir::record {

/// A <figure> with title, legend and inline SVG.
///
/// The outer SVG is the plot area and has no viewBox: places are percentages, so that words keep their size while the
/// plot takes any width. Lines lie in an inner SVG of 1000 x 1000 units that is stretched over it. The script of the
/// page turns places back into values by the data- attributes of the outer one.
std::string chart_figure(const Chart& chart);
std::string histogram_figure(const Histogram& histogram);

}  // namespace nadir::record
