#include "nadir/bench/report.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

#include "support/temporary_folder.h"

namespace nadir::bench {
namespace {

Row row(const std::string& method, double wall_ms, std::optional<double> error) {
  return {.suite = "s",
          .case_name = "c <1>",
          .method = method,
          .error = error,
          .error_unit = "DN",
          .cpu_ms = wall_ms,
          .wall_ms = wall_ms};
}

std::vector<Row> some_rows() {
  std::vector<Row> rows = {row("it's", 1, 4), row("b", 2, 0), row("c_d", 3, 2)};
  rows[0].counters = {{"ratio:b", "0.5"}, {"aim:b", "0.85"}, {"cpu_ratio:b", "1.5"}, {"cpu_aim:b", "1"}};
  for (int i = 0; i < 3; ++i) {
    rows.push_back(row("b", 1 << i, std::nullopt));
    rows.back().case_name = "side " + std::to_string(256 << i);
    rows.back().counters = {{"line", "reading"}, {"x", std::to_string(256 << i)}, {"x_label", "side, texels"}};
  }
  return rows;
}

bool have_gnuplot() { return std::system("gnuplot --version >/dev/null 2>&1") == 0; }

TEST(Report, NumbersAreShort) {
  EXPECT_EQ(short_number(0), "0");
  EXPECT_EQ(short_number(1234.56), "1235");
  EXPECT_EQ(short_number(12.3456), "12.35");
  EXPECT_EQ(short_number(0.0123456), "0.01235");
  EXPECT_EQ(short_number(1e-7), "1.000e-07");
}

TEST(Report, TheTableIsAlignedAndTellsRatiosBesideAims) {
  const std::string table = to_table(some_rows());
  EXPECT_NE(table.find("1.50x b in CPU (aim 1.00x) miss, 0.50x b (aim 0.85x) ok"), std::string::npos) << table;
  // Numbers end in the column where their heading does
  std::istringstream lines(table);
  std::string title, headings, first;
  std::getline(lines, title), std::getline(lines, headings), std::getline(lines, first);
  const std::size_t end = headings.find("wall ms") + 7;
  EXPECT_EQ(first[end], ' ') << table;
  EXPECT_NE(first[end - 1], ' ') << table;
}

TEST(Report, ThereIsAPictureForErrorsRatiosAndLines) {
  std::vector<std::string> names;
  for (const Picture& picture : pictures(some_rows())) names.push_back(picture.name);
  EXPECT_EQ(names, (std::vector<std::string>{"s-ratios", "s-c--1--error", "s-reading-time"}));
  EXPECT_TRUE(pictures({row("alone", 1, 1)}).empty()) << "one point shows no trade";
}

TEST(Report, FurtherErrorsAndFrontsHavePicturesOfTheirOwn) {
  auto rows = some_rows();
  rows.resize(3);
  rows.push_back(row("d", 4, 1));
  rows[0].counters = {{"error:truth", "3"}, {"front", "1 thread"}};
  rows[1].counters = {{"error:truth", "2"}, {"front", "1 thread"}};
  rows[2].counters = rows[3].counters = {{"front", "2 threads"}};
  std::vector<std::string> names;
  for (const Picture& picture : pictures(rows)) names.push_back(picture.name);
  EXPECT_EQ(names, (std::vector<std::string>{"s-c--1---1-thread-error", "s-c--1---1-thread-error-truth",
                                             "s-c--1---2-threads-error"}));
}

TEST(Report, APictureOfACaseIsPartOfThePage) {
  const test::TemporaryFolder folder;
  auto rows = some_rows();
  rows[0].counters["picture"] = "p.png";
  std::ofstream(folder.path() / "p.png") << "abc";
  ASSERT_TRUE(write_report(rows, {"nadir bench s", {}}, folder.path()));
  EXPECT_NE(test::bytes_of(folder.path() / "report.html").find("data:image/png;base64,YWJj"), std::string::npos);
}

TEST(Report, ThePageNeedsNoOtherFileAndEscapesNames) {
  const test::TemporaryFolder folder;
  const auto warning = write_report(some_rows(), {"nadir bench s -o 'a b'", {{"CPU", "a & b"}}}, folder.path());
  ASSERT_TRUE(warning) << warning.error().message;
  const std::string page = test::bytes_of(folder.path() / "report.html");
  EXPECT_NE(page.find("<table>"), std::string::npos);
  EXPECT_NE(page.find("c &lt;1&gt;"), std::string::npos);
  EXPECT_NE(page.find("a &amp; b"), std::string::npos);
  EXPECT_FALSE(std::regex_search(
      page, std::regex(R"((src|href)\s*=\s*["']\s*(https?:|//|[\w/.-]+\.)|url\(\s*["']?http|@import|<link|<script)")));
  EXPECT_EQ(from_csv("f", test::bytes_of(folder.path() / "results.csv")).value(), some_rows());
  if (!have_gnuplot()) {
    EXPECT_NE(warning->find("gnuplot"), std::string::npos);
    return;
  }
  EXPECT_EQ(*warning, "");
  for (const Picture& picture : pictures(some_rows())) {
    EXPECT_TRUE(test::bytes_of(folder.path() / (picture.name + ".png")).starts_with("\x89PNG")) << picture.name;
    EXPECT_NE(test::bytes_of(folder.path() / (picture.name + ".svg")).find("</svg>"), std::string::npos)
        << picture.name;
  }
  EXPECT_NE(page.find("</svg>"), std::string::npos);
  EXPECT_EQ(page.find("<?xml"), std::string::npos);
}

}  // namespace
}  // namespace nadir::bench
