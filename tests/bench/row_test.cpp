#include "nadir/bench/row.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace nadir::bench {
namespace {

Row full_row() {
  return {.suite = "read",
          .case_name = "tiles, \"cold\"",
          .method = "nadir",
          .setting = "line\nbreak",
          .error = 0.1 + 0.2,  // needs all 17 digits
          .error_unit = "DN",
          .cpu_ms = 1.0 / 3,
          .wall_ms = 1e-7,
          .peak_bytes = std::uint64_t{1} << 63,
          .counters = {{"rounds", "5"}, {"ratio:gdal", "0.8"}},
          .commit = "abc1234-dirty"};
}

TEST(Csv, GivesBackTheSameRows) {
  const std::vector<Row> rows = {full_row(), {.suite = "read", .case_name = "empty", .method = "m"}};
  const std::string text = to_csv(rows);
  EXPECT_TRUE(
      text.starts_with("suite,case,method,setting,error,error_unit,cpu_ms,wall_ms,peak_bytes,counters,commit\n"));
  EXPECT_NE(text.find("\"tiles, \"\"cold\"\"\""), std::string::npos) << text;
  EXPECT_EQ(from_csv("f", text).value(), rows);
}

TEST(Csv, ReadsTheLineEndsOfOtherPrograms) {
  std::string text = to_csv({{.suite = "s", .case_name = "c", .method = "m"}});
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.insert(at, 1, '\r');
  EXPECT_EQ(from_csv("f", text).value().front().method, "m");
}

TEST(Csv, AnyCutIsAnErrorOrFewerRowsNeverOtherOnes) {
  const std::string whole = to_csv({full_row(), full_row()});
  for (std::size_t n = 0; n < whole.size(); ++n) {
    const auto rows = from_csv("f", whole.substr(0, n));
    if (!rows) {
      EXPECT_EQ(rows.error().kind, Error::Kind::Malformed);
      EXPECT_TRUE(rows.error().message.starts_with("f: line ")) << rows.error().message;
      continue;
    }
    for (Row row : *rows) {  // the last field has no end that could be missed
      row.commit = full_row().commit;
      EXPECT_EQ(row, full_row()) << "cut at " << n;
    }
  }
}

TEST(Csv, FaultsNameLineAndColumn) {
  const auto message = [](const std::string& line) {
    const auto rows = from_csv("r.csv", to_csv({}) + line + "\n");
    return rows ? "no error" : rows.error().message;
  };
  EXPECT_EQ(message("s,c,m,,x,,,,,,"), "r.csv: line 2: error is 'x', expected a number or nothing");
  EXPECT_EQ(message("s,c,m,,,,,,-1,,"),
            "r.csv: line 2: peak_bytes is '-1', expected a whole number of bytes or nothing");
  EXPECT_EQ(message("s,c,m,,,,,,,rounds,"), "r.csv: line 2: counters is 'rounds', expected key=value;key=value");
  EXPECT_EQ(message("s,c,m"), "r.csv: line 2: expected 11 fields, found 3");
  EXPECT_NE(from_csv("r.csv", "a,b\n").error().message.find("expected the header"), std::string::npos);
  EXPECT_FALSE(from_csv("r.csv", ""));
}

TEST(Csv, FilesAreMergedInOrder) {
  const test::TemporaryFolder folder;
  const auto a = folder.write("a.csv", to_csv({{.suite = "a"}})), b = folder.write("b.csv", to_csv({{.suite = "b"}}));
  const auto rows = read_csv({b, a}).value();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].suite, "b");
  EXPECT_EQ(read_csv({folder.file("none.csv")}).error().kind, Error::Kind::NotFound);
}

}  // namespace
}  // namespace nadir::bench
