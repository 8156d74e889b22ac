#include "nadir/bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nadir/base/files.h"
#include "nadir/base/html.h"
#include "nadir/base/text.h"
#include "nadir/bench/measure.h"
#include "nadir/bench/runner.h"

namespace nadir::bench {
namespace {

constexpr std::array<std::string_view, 11> headings = {"method",      "wall ms", "middle half", "CPU ms",
                                                       "rate",        "error",   "PSNR dB",     "written",
                                                       "peak memory", "ratios",  "happened"};
using Line = std::array<std::string, headings.size()>;

std::string text_counter(const Row& row, const std::string& key) {
  const auto found = row.counters.find(key);
  return found == row.counters.end() ? "" : found->second;
}

std::string optional_number(const std::optional<double>& value) { return value ? short_number(*value) : ""; }

/// "0.71x gdal (aim 0.85x) ok", for each baseline; or why there is none.
std::string ratios_of(const Row& row) {
  std::string text;
  if (const std::string why = text_counter(row, "left_out"); !why.empty()) text = "left out: " + why;
  if (const std::string why = text_counter(row, "fault"); !why.empty()) text = "failed: " + why;
  for (const auto& [key, value] : row.counters)
    for (const std::string kind : {"", "cpu_", "peak_"}) {
      const std::string prefix = kind + "ratio:";
      const auto ratio = counter(row, key);
      if (!key.starts_with(prefix) || !ratio) continue;
      const std::string baseline = key.substr(prefix.size());
      text += fmt::format("{}{:.2f}x {}{}", text.empty() ? "" : ", ", *ratio, baseline,
                          kind == "cpu_"    ? " in CPU"
                          : kind == "peak_" ? " in memory"
                                            : "");
      const std::string missed = text_counter(row, kind + "missed:" + baseline);
      if (const auto aim = counter(row, kind + "aim:" + baseline))
        text += fmt::format(" (aim {:.2f}x) {}", *aim, *ratio <= *aim && missed.empty() ? "ok" : "miss");
      if (!missed.empty()) text += ": " + missed;
    }
  return text;
}

Line line_of(const Row& row) {
  const auto q1 = counter(row, "wall_q1_ms"), q3 = counter(row, "wall_q3_ms"), rate = counter(row, "rate"),
             written = counter(row, "written_bytes");
  return {label(row.method, row.setting),
          optional_number(row.wall_ms),
          q1 && q3 ? short_number(*q1) + " to " + short_number(*q3) : "",
          optional_number(row.cpu_ms),
          rate ? short_number(*rate) + " " + text_counter(row, "rate_unit") : "",
          row.error ? short_number(*row.error) + (row.error_unit.empty() ? "" : " " + row.error_unit) : "",
          text_counter(row, "psnr"),
          written ? format_bytes(static_cast<std::uint64_t>(*written)) : "",
          row.peak_bytes ? format_bytes(*row.peak_bytes) : "",
          ratios_of(row),
          text_counter(row, "happened")};
}

/// Counters that no column shows: those of the methods themselves.
std::string other_counters(const Row& row) {
  constexpr std::array<std::string_view, 16> shown = {
      "wall_q1_ms",  "wall_q3_ms", "rate",     "rate_unit", "line",     "x",    "x_label", "cpu_min_ms",
      "wall_min_ms", "fault",      "point_of", "left_out",  "happened", "psnr", "picture", "front"};
  std::string text;
  for (const auto& [key, value] : row.counters)
    if (key.find(':') == std::string::npos && std::find(shown.begin(), shown.end(), key) == shown.end())
      text += fmt::format("{}{} {}", text.empty() ? "" : ", ", key, value);
  return text;
}

bool left_aligned(std::size_t column) { return column == 0 || column + 2 >= headings.size(); }

struct Block {
  std::string suite, case_name;
  std::vector<const Row*> rows;
};

std::vector<Block> blocks(const std::vector<Row>& rows) {
  std::vector<Block> all;
  for (const Row& row : rows) {
    auto found = std::find_if(all.begin(), all.end(),
                              [&](const Block& b) { return b.suite == row.suite && b.case_name == row.case_name; });
    if (found == all.end()) found = all.insert(all.end(), {row.suite, row.case_name, {}});
    found->rows.push_back(&row);
  }
  return all;
}

/// Columns that say something in a block.
std::vector<std::size_t> filled_columns(const std::vector<Line>& lines) {
  std::vector<std::size_t> filled;
  for (std::size_t i = 0; i < headings.size(); ++i)
    if (std::any_of(lines.begin(), lines.end(), [&](const Line& line) { return !line[i].empty(); }))
      filled.push_back(i);
  return filled;
}

std::string html_table(const Block& block) {
  std::vector<Line> lines;
  for (const Row* row : block.rows) lines.push_back(line_of(*row));
  const auto columns = filled_columns(lines);
  std::string html = "<table><thead><tr>";
  for (const std::size_t i : columns)
    html += fmt::format("<th{}>{}</th>", left_aligned(i) ? " class=\"text\"" : "", headings[i]);
  html += "<th class=\"text\">counters</th></tr></thead><tbody>\n";
  for (std::size_t r = 0; r < lines.size(); ++r) {
    html += "<tr>";
    for (const std::size_t i : columns)
      html += fmt::format("<td{}>{}</td>", left_aligned(i) ? " class=\"text\"" : "", escaped(lines[r][i]));
    html += fmt::format("<td class=\"text small\">{}</td></tr>\n", escaped(other_counters(*block.rows[r])));
  }
  return html + "</tbody></table>\n";
}

constexpr auto style = R"(
body { font: 15px/1.5 "DejaVu Sans", system-ui, sans-serif; color: #222; max-width: 1200px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em } h2 { font-size: 1.3em; border-bottom: 1px solid #ccc; margin-top: 2em } h3 { font-size: 1.05em; margin-bottom: .3em }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; margin: .3em 0 1em }
th, td { padding: .2em .7em; text-align: right; border-bottom: 1px solid #e4e4e4; vertical-align: top }
th { border-bottom: 2px solid #999 } .text { text-align: left } .small { font-size: .8em; color: #666 }
code { background: #f3f3f3; padding: .15em .4em } svg, img { max-width: 100%; height: auto }
)";

/// The picture as an element of a page: without what makes it a file of its own.
std::string inline_svg(const std::string& file) {
  const std::size_t begin = file.find("<svg");
  return begin == std::string::npos ? "" : file.substr(begin);
}

Result<std::string> html_page(const std::vector<Row>& rows, const ReportInfo& info, const std::vector<Picture>& shown,
                              const std::filesystem::path& folder) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Nadir benchmarks</title>\n";
  html += fmt::format("<style>{}</style></head><body>\n<h1>Nadir benchmarks</h1>\n<table>\n", style);
  for (const auto& [name, value] : info.machine)
    html +=
        fmt::format("<tr><th class=\"text\">{}</th><td class=\"text\">{}</td></tr>\n", escaped(name), escaped(value));
  html += fmt::format("</table>\n<p>To get this again: <code>{}</code></p>\n", escaped(info.command));
  html +=
      "<p>Times are medians over rounds in which all methods of a case take turns; a ratio is the median of the "
      "rounds' ratios.</p>\n";
  std::string suite;
  for (const Block& block : blocks(rows)) {
    if (block.suite != suite) {
      suite = block.suite;
      html += fmt::format("<h2>{}</h2>\n", escaped(suite));
      for (const Picture& picture : shown) {
        if (picture.suite != suite) continue;
        const auto svg = read_text_file(folder / (picture.name + ".svg"));
        if (!svg) return fail(svg);
        html += inline_svg(*svg) + "\n";
      }
    }
    html += fmt::format("<h3>{}</h3>\n{}", escaped(block.case_name), html_table(block));
    for (const Row* row : block.rows)
      if (const std::string name = text_counter(*row, "picture"); !name.empty())
        // A page drawn again from results alone has none
        if (const auto png = read_text_file(folder / name))
          html +=
              fmt::format("<p><img alt=\"{}\" src=\"data:image/png;base64,{}\"></p>\n", escaped(name), base64(*png));
  }
  return html + "</body></html>\n";
}

std::string gnuplot_string(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out.append(c == '\'' ? 2 : 1, c);
  return out + '\'';
}

Result<void> draw(const Picture& picture, const std::filesystem::path& folder) {
  std::string script;
  for (const std::string kind : {"png", "svg"})
    script += fmt::format(
        "reset\nset terminal {} size {},{} font 'DejaVu Sans,{}' noenhanced background '#ffffff'\n"
        "set output {}\nset title {}\n{}\nset output\n",
        kind == "png" ? "pngcairo" : "svg", picture.width_px, picture.height_px, kind == "png" ? 11 : 14,
        gnuplot_string((folder / (picture.name + "." + kind)).string()), gnuplot_string(picture.title), picture.script);
  const auto file = folder / (picture.name + ".gnuplot");
  if (const auto written = write_file(file, script); !written) return written;
  const auto drawn = measure_command({"gnuplot", file.string()});
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  if (!drawn) return fail(drawn);
  return {};
}

}  // namespace

std::string short_number(double value) {
  const double size = std::abs(value);
  if (size != 0 && (size < 1e-3 || size >= 1e6)) return fmt::format("{:.3e}", value);
  const int digits = size == 0 ? 0 : std::clamp(3 - static_cast<int>(std::floor(std::log10(size))), 0, 6);
  return fmt::format("{:.{}f}", value, digits);
}

std::string to_table(const std::vector<Row>& rows) {
  std::string text;
  for (const Block& block : blocks(rows)) {
    std::vector<Line> lines;
    for (const Row* row : block.rows) lines.push_back(line_of(*row));
    const auto columns = filled_columns(lines);
    lines.insert(lines.begin(), Line{});
    std::copy(headings.begin(), headings.end(), lines.front().begin());
    text += fmt::format("{}: {}\n", block.suite, block.case_name);
    for (const Line& line : lines) {
      std::string row = " ";
      for (const std::size_t i : columns) {
        std::size_t width = 0;
        for (const Line& other : lines) width = std::max(width, other[i].size());
        row += left_aligned(i) ? fmt::format(" {:<{}} ", line[i], width) : fmt::format(" {:>{}} ", line[i], width);
      }
      row.erase(row.find_last_not_of(' ') + 1);
      text += row + '\n';
    }
    text += '\n';
  }
  return text;
}

Result<std::string> write_report(const std::vector<Row>& rows, const ReportInfo& info,
                                 const std::filesystem::path& folder) {
  if (const auto written = write_file(folder / "results.csv", to_csv(rows)); !written) return fail(written);
  std::string warning;
  std::vector<Picture> shown;
  for (Picture& picture : pictures(rows)) {
    const auto drawn = draw(picture, folder);
    if (!drawn && drawn.error().kind == Error::Kind::NotFound) {
      warning = "gnuplot is not installed, so there are no pictures; install gnuplot-nox, then `nadir bench report`";
      break;
    }
    if (!drawn) return fail(drawn);
    shown.push_back(std::move(picture));
  }
  const auto html = html_page(rows, info, shown, folder);
  if (!html) return fail(html);
  if (const auto written = write_file(folder / "report.html", *html); !written) return fail(written);
  return warning;
}

}  // namespace nadir::bench
