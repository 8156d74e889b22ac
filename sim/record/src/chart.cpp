#include "chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "nadir/base/html.h"

namespace nadir::record {
namespace {

constexpr std::size_t most_points = 1500, colours = 6;
constexpr double units = 1000;  // side of the inner SVG

/// Ranges and steps of smaller magnitudes neither overflow nor become denormal.
bool drawable(double value) { return std::abs(value) <= 1e290; }
bool drawable(const ChartPoint& point) { return drawable(point.x) && drawable(point.y); }

struct Range {
  double low = 0, high = 0;
  bool empty = true;
  void include(double value) {
    low = empty ? value : std::min(low, value);
    high = empty ? value : std::max(high, value);
    empty = false;
  }
};

/// A step of 1, 2 or 5 times a power of ten that divides `span` into `wanted` parts, from 2/3 to 7/4 of that many.
struct Step {
  Step(double span, double wanted) {
    exponent = static_cast<int>(std::floor(std::log10(span / wanted)));
    const double mantissa = span / wanted / std::pow(10.0, exponent);
    factor = mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10;
  }
  /// Dividing by a whole power of ten gives the double nearest to the decimal number: 0.3 and not 3 * 0.1.
  double times(double count) const {
    return exponent < 0 ? count * factor / std::pow(10.0, -exponent) : count * factor * std::pow(10.0, exponent);
  }
  int exponent;
  double factor;
};

struct Tick {
  double value;
  std::string label;
};

struct Axis {
  double low, high;
  int power = 0;     // labels are in units of ten to this power
  int decimals = 0;  // of labels
  std::vector<Tick> ticks = {};

  double fraction(double value) const { return (value - low) / (high - low); }
  std::string number(double value, int more_decimals) const {
    std::string text = fmt::format("{:.{}f}", value / std::pow(10.0, power), std::min(decimals + more_decimals, 17));
    if (text.find_first_of("123456789") == std::string::npos && text.front() == '-') text.erase(0, 1);
    if (text.front() == '-') text.replace(0, 1, "−");
    return text;
  }
};

/// `margin`: what is added at both ends, as a part of the range.
Axis axis_over(Range range, double margin, double wanted_ticks) {
  if (range.empty) return {0, 1};
  // What differs by rounding only is one value: it lies in the middle
  const double largest = std::max({std::abs(range.low), std::abs(range.high), 1e-290});
  double span = range.high - range.low;
  if (span <= 1e-12 * largest) {
    const double half = largest > 1e-290 ? 0.1 * largest : 1;
    range.low -= half;
    range.high += half;
  } else {
    range.low -= margin * span;
    range.high += margin * span;
  }
  Axis axis{range.low, range.high};
  span = axis.high - axis.low;
  const Step step(span, wanted_ticks);
  const double reach = std::max(std::abs(axis.low), std::abs(axis.high));
  // 4 × 10⁹ where zeros would fill the label, and 1780000010 where all its digits count
  if (step.exponent >= 5 || reach >= 1e12 || reach < 1e-3)
    axis.power = 3 * static_cast<int>(std::floor(std::log10(reach) / 3));
  axis.decimals = std::max(0, axis.power - step.exponent - (step.factor == 10));
  const double first = std::ceil(axis.low / step.times(1) - 1e-6), last = std::floor(axis.high / step.times(1) + 1e-6);
  for (double i = first; i <= last; ++i) axis.ticks.push_back({step.times(i), axis.number(step.times(i), 0)});
  return axis;
}

std::size_t longest_label(const Axis& axis) {
  std::size_t longest = 0;  // a minus takes three bytes and one place
  for (const Tick& tick : axis.ticks)
    longest = std::max(longest, tick.label.size() - (tick.label.starts_with("−") ? 2 : 0));
  return longest;
}

/// An axis below a plot: as many ticks as find room on a phone, which is about 40 characters wide.
Axis axis_below(Range range) {
  Axis axis = axis_over(range, 0, 5);
  for (const double fewer : {3.0, 1.5})
    if (axis.ticks.size() * (longest_label(axis) + 1) > 40) axis = axis_over(range, 0, fewer);
  return axis;
}

std::string with_power(const std::string& label, const Axis& axis) {
  if (axis.power == 0) return escaped(label);
  constexpr const char* digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string power = axis.power < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(axis.power))) power += digits[digit - '0'];
  return fmt::format("{} (× 10{})", escaped(label), power);
}

/// "12.5", "12", "0": at most two decimals.
std::string short_number(double value) {
  std::string text = fmt::format("{:.2f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string percent(double fraction) { return short_number(100 * fraction) + "%"; }

/// What lies around the lines of a chart and the bars of a histogram.
struct Frame {
  std::string title, y_label, x_label, legend, data, note = {};
  Axis x, y;
  bool empty;
};

std::string figure(const Frame& frame) {
  std::string out;
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "<figure class=\"item chart\"><figcaption><h3>{}</h3>", escaped(frame.title));
  fmt::format_to(to, "<ul class=\"legend\">{}</ul><p class=\"label\">{}</p></figcaption>\n", frame.legend,
                 with_power(frame.y_label, frame.y));
  fmt::format_to(to, "<svg class=\"plot\" style=\"--left:{}ch\" role=\"img\" aria-label=\"{}\"",
                 std::min<std::size_t>(longest_label(frame.y), 20) + 1, escaped(frame.title));
  fmt::format_to(to, " data-x=\"{} {} {} {}\" data-y=\"{} {} {} {}\">\n", frame.x.low, frame.x.high, frame.x.power,
                 frame.x.decimals, frame.y.low, frame.y.high, frame.y.power, frame.y.decimals);
  for (const Tick& tick : frame.x.ticks) {
    const std::string at = percent(frame.x.fraction(tick.value));
    fmt::format_to(to,
                   "<line class=\"rule\" x1=\"{0}\" x2=\"{0}\" y1=\"0\" y2=\"100%\"/><text x=\"{0}\" y=\"100%\" "
                   "dy=\"17\" text-anchor=\"middle\">{1}</text>\n",
                   at, tick.label);
  }
  for (const Tick& tick : frame.y.ticks) {
    const std::string at = percent(1 - frame.y.fraction(tick.value));
    fmt::format_to(to,
                   "<line class=\"rule\" y1=\"{0}\" y2=\"{0}\" x1=\"0\" x2=\"100%\"/><text x=\"0\" y=\"{0}\" dx=\"-7\" "
                   "dy=\"4\" text-anchor=\"end\">{1}</text>\n",
                   at, tick.label);
  }
  out += "<line class=\"axis\" x1=\"0\" x2=\"100%\" y1=\"100%\" y2=\"100%\"/>\n";
  if (frame.empty) out += "<text class=\"nothing\" x=\"50%\" y=\"50%\" text-anchor=\"middle\">no data</text>\n";
  fmt::format_to(to, "{}</svg>\n<p class=\"label below\">{}</p>", frame.data, with_power(frame.x_label, frame.x));
  if (!frame.note.empty()) fmt::format_to(to, "<p class=\"note\">{}</p>", escaped(frame.note));
  out += "</figure>\n";
  return out;
}

constexpr const char* open_lines =
    "<svg class=\"lines\" width=\"100%\" height=\"100%\" viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\">\n";

/// Which of the points are drawn: the first, least, greatest and last of each stretch. A line drawn through them
/// covers the same pixels as the line through all. Jugel et al., M4: A Visualization-Oriented Time Series Data
/// Aggregation, 2014.
std::vector<std::size_t> decimated(const std::vector<ChartPoint>& points) {
  std::vector<std::size_t> seen, kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (drawable(points[i])) seen.push_back(i);
  if (seen.size() <= most_points) return seen;

  constexpr std::size_t stretches = most_points / 4;
  const auto below = [&](std::size_t a, std::size_t b) { return points[a].y < points[b].y; };
  for (std::size_t s = 0; s < stretches; ++s) {
    const auto begin = seen.begin() + static_cast<std::ptrdiff_t>(s * seen.size() / stretches);
    const auto end = seen.begin() + static_cast<std::ptrdiff_t>((s + 1) * seen.size() / stretches);
    const auto [least, greatest] = std::minmax_element(begin, end, below);
    for (auto it = begin; it != end; ++it)
      if (it == begin || it == least || it == greatest || it + 1 == end) kept.push_back(*it);
  }
  return kept;
}

struct PathData {
  std::string line;  // with a move at each break
  std::string dots;  // the points without neighbours once more
};

PathData path_data(const Series& series, const Axis& x, const Axis& y) {
  // Points before i that break the line
  std::vector<std::size_t> breaks(series.points.size() + 1, 0);
  for (std::size_t i = 0; i < series.points.size(); ++i) breaks[i + 1] = breaks[i] + !drawable(series.points[i]);

  const std::vector<std::size_t> kept = decimated(series.points);
  const auto joined = [&](std::size_t k) { return k > 0 && k < kept.size() && breaks[kept[k]] == breaks[kept[k - 1]]; };
  PathData out;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const ChartPoint& point = series.points[kept[k]];
    const std::string place =
        short_number(units * x.fraction(point.x)) + ' ' + short_number(units * (1 - y.fraction(point.y)));
    out.line += (joined(k) ? ' ' : 'M') + place;
    if (!joined(k) && !joined(k + 1)) out.dots += 'M' + place + "h0";  // seen by its round ends
  }
  return out;
}

std::string style_of(std::size_t index, bool dashed) {
  return fmt::format("c{}{}{}", index % colours, index / colours % 2 == 1 ? " dotted" : "", dashed ? " dashed" : "");
}

/// The value that a part `fraction` of all does not exceed; `sorted` is not empty.
double quantile(const std::vector<double>& sorted, double fraction) {
  const double rank = std::ceil(fraction * static_cast<double>(sorted.size()));
  return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

}  // namespace

std::string chart_figure(const Chart& chart) {
  Range x_range, y_range;
  std::size_t infinite = 0;
  for (const Series& series : chart.series)
    for (const ChartPoint& point : series.points) {
      infinite += !std::isnan(point.x) && !std::isnan(point.y) && !drawable(point);
      if (!drawable(point)) continue;
      x_range.include(point.x);
      y_range.include(point.y);
    }
  const bool empty = x_range.empty;
  for (const ReferenceLine& line : chart.references)
    if (drawable(line.y) && !empty) y_range.include(line.y);

  Frame frame{.title = chart.title,
              .y_label = chart.y_label,
              .x_label = chart.x_label,
              .legend = {},
              .data = {},
              .x = axis_below(x_range),
              .y = axis_over(y_range, 0.06, 5),
              .empty = empty};
  if (infinite > 0)
    frame.note = fmt::format("{} {} infinite or beyond 1e290 and not drawn.", infinite,
                             infinite == 1 ? "value is" : "values are");

  std::string references;
  for (const ReferenceLine& line : chart.references) {
    if (!drawable(line.y) || empty) continue;
    const double at = 1 - frame.y.fraction(line.y);
    frame.data += fmt::format("<line class=\"reference\" x1=\"0\" x2=\"100%\" y1=\"{0}\" y2=\"{0}\"/>\n", percent(at));
    references +=
        fmt::format("<text class=\"reference\" x=\"100%\" y=\"{}\" dx=\"-4\" dy=\"{}\" text-anchor=\"end\">{}</text>\n",
                    percent(at), at < 0.1 ? 14 : -5, escaped(line.name));
  }
  frame.data += open_lines;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& series = chart.series[i];
    const bool nothing =
        std::none_of(series.points.begin(), series.points.end(), [](const ChartPoint& p) { return drawable(p); });
    const std::string style = style_of(i, series.dashed);
    frame.legend += fmt::format("<li class=\"{}\"><i></i>{}{}<output></output></li>", style, escaped(series.name),
                                nothing ? " (no data)" : "");
    const PathData path = path_data(series, frame.x, frame.y);
    frame.data += fmt::format("<path class=\"line {}\" d=\"{}\"/>\n", style, path.line);
    if (!path.dots.empty()) frame.data += fmt::format("<path class=\"dots {}\" d=\"{}\"/>\n", style, path.dots);
  }
  frame.data += "</svg>\n" + references;
  return figure(frame);
}

std::string histogram_figure(const Histogram& histogram) {
  std::vector<double> sorted;
  std::copy_if(histogram.values.begin(), histogram.values.end(), std::back_inserter(sorted),
               [](double v) { return drawable(v); });
  std::sort(sorted.begin(), sorted.end());
  Frame frame{.title = histogram.title,
              .y_label = histogram.counted,
              .x_label = histogram.x_label,
              .legend = {},
              .data = {},
              .x = axis_below({}),
              .y = axis_over({}, 0, 4),
              .empty = sorted.empty()};
  const std::size_t left_out = histogram.values.size() - sorted.size();
  if (left_out > 0)
    frame.note = fmt::format("{} of {} values are not finite and not counted.", left_out, histogram.values.size());
  if (sorted.empty()) return figure(frame);

  // Bars of a round width up to the last value, or to the 99th percentile where the rest lies far beyond
  const double low = sorted.front(), usual = quantile(sorted, 0.99), high = sorted.back();
  const bool has_tail = usual > low && high - low > 3 * (usual - low);
  const double last = has_tail ? usual : high;
  const double largest = std::max({std::abs(low), std::abs(last), 1e-290});
  const bool constant = last - low <= 1e-12 * largest;
  const Step step(constant ? (largest > 1e-290 ? largest : 1) : last - low, 25);
  const double width = step.times(1), first_bar = std::floor(low / width);
  const auto bar_of = [&](double value) { return std::floor(value / width) - first_bar; };
  std::vector<std::size_t> bars(static_cast<std::size_t>(bar_of(last)) + 1, 0);
  std::size_t tail = 0;
  for (const double value : sorted) {
    if (bar_of(value) < static_cast<double>(bars.size()))
      ++bars[static_cast<std::size_t>(bar_of(value))];
    else
      ++tail;
  }
  const double begin = step.times(first_bar), end = step.times(first_bar + static_cast<double>(bars.size()));

  Range x_range, y_range;
  const double beside = bars.size() == 1 ? 5 * width : 0;  // a single bar is not as wide as the plot
  x_range.include(begin - beside);
  x_range.include(tail > 0 ? end + 3 * width : end + beside);
  y_range.include(0);
  y_range.include(static_cast<double>(std::max(tail, *std::max_element(bars.begin(), bars.end()))) * 1.06);
  frame.x = axis_below(x_range);
  frame.y = axis_over(y_range, 0, 4);
  if (frame.y.decimals > 0) {  // a count is whole
    std::erase_if(frame.y.ticks, [](const Tick& tick) { return tick.value != std::round(tick.value); });
    frame.y.decimals = 0;
    for (Tick& tick : frame.y.ticks) tick.label = frame.y.number(tick.value, 0);
  }
  if (tail > 0) std::erase_if(frame.x.ticks, [&](const Tick& tick) { return tick.value > end; });

  frame.data = open_lines;
  const auto bar = [&](double from, double to, std::size_t count, const std::string& what) {
    if (count == 0) return;
    const double left = units * frame.x.fraction(from),
                 top = units * (1 - frame.y.fraction(static_cast<double>(count)));
    frame.data += fmt::format(
        "<rect class=\"bar\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"><title>{}: {} {}</title></rect>\n",
        short_number(left), short_number(top), short_number(units * frame.x.fraction(to) - left),
        short_number(units - top), what, count, escaped(histogram.counted));
  };
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const double from = step.times(first_bar + static_cast<double>(i)),
                 to = step.times(first_bar + static_cast<double>(i + 1));
    bar(from, to, bars[i], fmt::format("{} to {}", frame.x.number(from, 2), frame.x.number(to, 2)));
  }
  bar(end + width, end + 3 * width, tail, fmt::format("{} to {}", frame.x.number(end, 2), frame.x.number(high, 2)));

  const double median = quantile(sorted, 0.5), most = quantile(sorted, 0.95);
  const auto mark = [&](double value, const char* style, const char* name) {
    if (value <= end) {
      const std::string at = short_number(units * frame.x.fraction(value));
      frame.data += fmt::format("<path class=\"line mark {}\" d=\"M{} 0V1000\"/>\n", style, at);
    }
    frame.legend += fmt::format("<li class=\"{}\"><i></i>{} {}</li>", style, name, frame.x.number(value, 2));
  };
  mark(median, "strong", "median");
  mark(most, "strong dashed", "95 % within");
  frame.legend += fmt::format("<li>largest {}</li>", frame.x.number(high, 2));
  frame.data += "</svg>\n";
  if (tail > 0)
    frame.data += fmt::format("<text class=\"tail\" x=\"{}\" y=\"100%\" dy=\"17\" text-anchor=\"middle\">more</text>\n",
                              percent(frame.x.fraction(end + 2 * width)));
  return figure(frame);
}

}  // namespace nadir::record
