#include "nadir/record/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string_view>

#include "chart.h"
#include "nadir/base/files.h"
#include "nadir/base/html.h"
#include "nadir/base/text.h"
#include "report_assets.h"

namespace nadir::record {
namespace {

// Only what the page holds may load: that it needs no network is then checked by the browser
constexpr const char* head = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
)";

/// `number` names the picture within the page.
Result<std::string> html_of(const Picture& picture, std::size_t number) {
  const auto bytes = read_text_file(picture.file);
  if (!bytes) return fail(bytes);
  // Signature, then the chunk IHDR: length, type, width and height, most significant byte first
  constexpr std::string_view signature("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
  if (bytes->size() < 24 || !bytes->starts_with(signature))
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a PNG image, for the report", picture.file.string()));
  const auto size_px = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | static_cast<std::uint8_t>((*bytes)[i]);
    return value;
  };
  // A check box remembers what is shown in full size, without script
  return fmt::format(
      "<figure class=\"item picture\"><input type=\"checkbox\" id=\"picture{0}\" aria-label=\"full size: {1}\"><label "
      "for=\"picture{0}\">"
      "<img width=\"{2}\" height=\"{3}\" alt=\"{1}\" "
      "src=\"data:image/png;base64,{4}\"></label><figcaption>{1}</figcaption></figure>\n",
      number, escaped(picture.caption), size_px(16), size_px(20), base64(*bytes));
}

std::string heading(const std::string& title) {
  return title.empty() ? "" : fmt::format("<h3>{}</h3>", escaped(title));
}

/// "12.5", "-3 m", "98 %", "1.5 MiB": a number and at most one word.
bool is_quantity(std::string_view cell) {
  const auto words = split(trim(cell), ' ');
  return words.size() <= 2 && parse_number(words.front());
}

std::string html_of(const Table& table) {
  std::size_t columns = table.header.size();
  for (const auto& row : table.rows) columns = std::max(columns, row.size());
  const auto cell = [](const std::vector<std::string>& row, std::size_t column) {
    return column < row.size() ? row[column] : std::string();
  };
  std::vector<bool> numbers(columns, false);
  for (std::size_t c = 0; c < columns; ++c) {
    const auto fits = [&](const auto& row) {
      return trim(cell(row, c)).empty() || cell(row, c) == "–" || is_quantity(cell(row, c));
    };
    const auto counts = [&](const auto& row) { return is_quantity(cell(row, c)); };
    numbers[c] = std::all_of(table.rows.begin(), table.rows.end(), fits) &&
                 std::any_of(table.rows.begin(), table.rows.end(), counts);
  }

  std::string out = fmt::format("<div class=\"item table\">{}<table>", heading(table.title));
  const auto add_row = [&](const std::vector<std::string>& row, const char* tag) {
    out += "<tr>";
    for (std::size_t c = 0; c < columns; ++c)
      out += fmt::format("<{0}{1}>{2}</{0}>", tag, numbers[c] ? " class=\"number\"" : "", escaped(cell(row, c)));
    out += "</tr>\n";
  };
  out += "<thead>";
  add_row(table.header, "th");
  out += "</thead><tbody>";
  for (const auto& row : table.rows) add_row(row, "td");
  return out + "</tbody></table></div>\n";
}

std::string html_of(const List& list) {
  std::string out = fmt::format("<div class=\"item list\">{}<ul>", heading(list.title));
  for (const std::string& line : list.lines) out += fmt::format("<li>{}</li>", escaped(line));
  return out + "</ul></div>\n";
}

/// The items of one kind that follow each other share a grid; charts and histograms are of one kind.
std::size_t kind_of(const ReportItem& item) {
  return std::holds_alternative<Histogram>(item) ? ReportItem(Chart{}).index() : item.index();
}

std::string html_of(const std::vector<Figure>& figures) {
  std::string out = "<dl class=\"figures\">";
  for (const Figure& figure : figures) {
    constexpr const char* style[] = {"plain", "good", "warn"};
    constexpr const char* mark[] = {"", "<span class=\"state\" aria-label=\"good\">✓</span> ",
                                    "<span class=\"state\" aria-label=\"attention\">▲</span> "};
    const auto state = static_cast<std::size_t>(figure.state);
    out += fmt::format("<div class=\"{}\"><dt>{}{}</dt><dd class=\"value\">{}", style[state], mark[state],
                       escaped(figure.label), escaped(figure.value));
    if (!figure.unit.empty()) out += fmt::format("<span class=\"unit\">{}</span>", escaped(figure.unit));
    out += "</dd>";
    if (!figure.remark.empty()) out += fmt::format("<dd class=\"remark\">{}</dd>", escaped(figure.remark));
    out += "</div>\n";
  }
  return out + "</dl>\n";
}

}  // namespace

Result<void> write_report(const std::filesystem::path& path, const Report& report) {
  std::string page = head;
  page += fmt::format("<title>{}</title>\n<style>{}</style></head>\n<body><header><h1>{}</h1>\n", escaped(report.title),
                      report_style, escaped(report.title));
  if (!report.subtitle.empty()) page += fmt::format("<p class=\"subtitle\">{}</p>\n", escaped(report.subtitle));
  if (!report.figures.empty()) page += html_of(report.figures);
  if (report.sections.size() > 1) {
    page += "<nav>";
    for (std::size_t i = 0; i < report.sections.size(); ++i)
      page += fmt::format("<a href=\"#section{}\">{}</a>", i, escaped(report.sections[i].heading));
    page += "</nav>";
  }
  page += "</header>\n<main>\n";

  std::size_t pictures = 0;
  for (std::size_t i = 0; i < report.sections.size(); ++i) {
    const Section& section = report.sections[i];
    page += fmt::format("<section id=\"section{}\"><h2>{}</h2>\n", i, escaped(section.heading));
    if (!section.text.empty()) page += fmt::format("<p class=\"text\">{}</p>\n", escaped(section.text));
    for (std::size_t k = 0; k < section.items.size(); ++k) {
      const ReportItem& item = section.items[k];
      if (k == 0 || kind_of(item) != kind_of(section.items[k - 1]))
        page += k == 0 ? "<div class=\"grid\">\n" : "</div>\n<div class=\"grid\">\n";
      if (const auto* picture = std::get_if<Picture>(&item)) {
        const auto html = html_of(*picture, pictures++);
        if (!html) return fail(html);
        page += *html;
      }
      if (const auto* chart = std::get_if<Chart>(&item)) page += chart_figure(*chart);
      if (const auto* histogram = std::get_if<Histogram>(&item)) page += histogram_figure(*histogram);
      if (const auto* table = std::get_if<Table>(&item)) page += html_of(*table);
      if (const auto* list = std::get_if<List>(&item)) page += html_of(*list);
    }
    if (!section.items.empty()) page += "</div>\n";
    page += "</section>\n";
  }
  page += fmt::format(
      "</main>\n<footer>Made by Nadir. This page holds all that it "
      "shows.</footer>\n<script>{}</script></body></html>\n",
      report_script);
  return write_file(path, page);
}

}  // namespace nadir::record
