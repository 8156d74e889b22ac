#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::record {

/// A big number at the top of a report.
struct Figure {
  enum class State { Plain, Good, Warn };
  std::string label;
  std::string value;  // "12.3"
  std::string unit = {};
  std::string remark = {};
  State state = State::Plain;
};

/// A PNG file, which the page holds whole: its bytes count by four thirds.
struct Picture {
  std::filesystem::path file;
  std::string caption = {};
};

struct ChartPoint {
  double x = std::numeric_limits<double>::quiet_NaN();
  double y = std::numeric_limits<double>::quiet_NaN();
};

/// A line through points in their order; x is meant to rise.
///
/// A value that is NaN, infinite or beyond 1e290 breaks the line, and a point without neighbours is a dot. Of more
/// than 1500 points those are drawn that carry the shape: no least or greatest value of a stretch is lost, and no
/// break.
struct Series {
  std::string name;
  std::vector<ChartPoint> points;
  bool dashed = false;  // for what was commanded beside what was flown
};

/// A level across a chart, such as a limit; the y axis reaches to it.
struct ReferenceLine {
  std::string name;
  double y = 0;
};

struct Chart {
  std::string title;
  std::string y_label;  // with unit: "height / m"
  std::vector<Series> series;
  std::vector<ReferenceLine> references = {};
  std::string x_label = "time / s";  // the read-out moves together in all charts of one label
};

/// How often values occur, with their median and 95th percentile (nearest rank).
/// Where a few values lie far above all others, one last bar counts them. Values that are not finite are left out.
struct Histogram {
  std::string title;
  std::string x_label;  // with unit: "frame cost / ms"
  std::vector<double> values;
  std::string counted = "frames";  // what one value is
};

/// Columns whose cells all are numbers, with or without a unit, are set to the right. Short rows are filled up.
struct Table {
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};

struct List {
  std::string title;
  std::vector<std::string> lines;
};

using ReportItem = std::variant<Picture, Chart, Histogram, Table, List>;

struct Section {
  std::string heading;
  std::string text = {};  // line breaks are kept
  std::vector<ReportItem> items = {};
};

/// A page about a run, for people.
struct Report {
  std::string title;
  std::string subtitle = {};
  std::vector<Figure> figures = {};
  std::vector<Section> sections = {};
};

/// Writes one HTML file that needs no other file and no network: pictures and charts (SVG) are inside, and it is
/// complete without its script, which only adds read-outs. All texts are plain text in UTF-8, what is not UTF-8
/// becomes U+FFFD. The same report gives the same bytes.
/// Error: where a picture cannot be read or is no PNG; nothing is written then.
Result<void> write_report(const std::filesystem::path& path, const Report& report);

}  // namespace nadir::record
