#include "nadir/record/report.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <regex>
#include <set>
#include <sstream>

#include "nadir/base/files.h"
#include "support/small_disk.h"
#include "support/temporary_folder.h"

namespace nadir::record {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();

// ---- Looking into a page

/// The text between the first `before` and the next `after`.
std::string between(const std::string& text, const std::string& before, const std::string& after) {
  const std::size_t begin = text.find(before);
  if (begin == std::string::npos) return "";
  const std::size_t end = text.find(after, begin + before.size());
  return end == std::string::npos ? "" : text.substr(begin + before.size(), end - begin - before.size());
}

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + word.size())) ++n;
  return n;
}

/// A line as drawn: runs of points, x and y in 0 .. 1000 with y downwards.
using Stroke = std::vector<ChartPoint>;
std::vector<Stroke> runs_of(const std::string& path_data) {
  std::vector<Stroke> runs;
  std::istringstream moves(path_data);
  std::string run;
  std::getline(moves, run, 'M');
  while (std::getline(moves, run, 'M')) {
    std::istringstream numbers(run);
    runs.emplace_back();
    for (ChartPoint p; numbers >> p.x >> p.y;) runs.back().push_back(p);
  }
  return runs;
}

/// A tag with its long attribute values emptied where they hold nothing that needs an entity: regular expressions
/// recurse, and path data are longer than a stack is deep.
std::string without_long_values(std::string tag) {
  constexpr std::size_t longest = 200;
  for (std::size_t begin = tag.find("=\""); begin != std::string::npos; begin = tag.find("=\"", begin + 2)) {
    const std::size_t end = tag.find('"', begin + 2);
    if (end == std::string::npos) break;
    const std::string value = tag.substr(begin + 2, end - begin - 2);
    if (value.size() > longest && value.find_first_of("<&") == std::string::npos) tag.erase(begin + 2, value.size());
  }
  return tag;
}

/// Why `text` is not a well-formed XML element; empty where it is. Knows what our SVG uses: elements, quoted
/// attributes, text, the five entities and numeric ones.
std::string xml_fault(const std::string& text) {
  static const std::regex tag(
      R"re(<(/?)([A-Za-z][\w]*)((?:\s+[\w-]+="(?:[^"<&]|&(?:amp|lt|gt|quot|#39);)*")*)\s*(/?)>)re");
  static const std::regex attribute(R"re(([\w-]+)=")re");
  static const std::regex plain(R"re((?:[^<>&]|&(?:amp|lt|gt|quot|#39);)*)re");
  std::vector<std::string> open;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t next = std::min(text.find('<', at), text.size());
    const std::string words = text.substr(at, next - at);
    if (!std::regex_match(words, plain)) return "bad text: " + words;
    if (next == text.size()) break;
    const std::size_t end = text.find('>', next);
    if (end == std::string::npos) return "open tag";
    const std::string found = text.substr(next, end - next + 1);
    const std::string shortened = without_long_values(found);
    std::smatch parts;
    if (!std::regex_match(shortened, parts, tag)) return "bad tag: " + shortened;
    const std::string attributes = parts[3];
    std::set<std::string> names;
    for (std::sregex_iterator it(attributes.begin(), attributes.end(), attribute), none; it != none; ++it)
      if (!names.insert((*it)[1]).second) return "attribute twice: " + found;
    if (parts[1].length() > 0) {
      if (open.empty() || open.back() != parts[2]) return "does not close what is open: " + found;
      open.pop_back();
    } else if (parts[4].length() == 0) {
      open.push_back(parts[2]);
    }
    at = end + 1;
    if (open.empty() && at != text.size()) return "more than one element";
  }
  return open.empty() ? "" : "not closed: " + open.back();
}

/// The outer SVG elements of a page.
std::vector<std::string> plots_of(const std::string& page) {
  std::vector<std::string> plots;
  for (std::size_t begin = page.find("<svg class=\"plot\""); begin != std::string::npos;
       begin = page.find("<svg class=\"plot\"", begin + 1))
    plots.push_back(page.substr(begin, page.find("</figure>", begin) - begin));
  for (std::string& plot : plots) plot.resize(plot.rfind("</svg>") + 6);
  return plots;
}

class ReportTest : public testing::Test {
 protected:
  std::string page(const Report& report) {
    const auto written = write_report(folder.file("report.html"), report);
    EXPECT_TRUE(written) << (written ? "" : written.error().message);
    return test::bytes_of(folder.file("report.html"));
  }
  std::string page(ReportItem item) { return page(Report{"t", "", {}, {{"s", "", {std::move(item)}}}}); }
  std::vector<Stroke> drawn(std::vector<ChartPoint> points) {
    return runs_of(between(page(Chart{"c", "y", {{"a", std::move(points)}}}), "<path class=\"line c0\" d=\"", "\""));
  }
  /// A file that begins as a PNG of 3x2 pixels does; the page looks no further.
  std::string small_png(const std::string& name, const std::string& rest) {
    std::string bytes("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\3\0\0\0\2", 24);
    return folder.write(name, bytes + rest);
  }
  test::TemporaryFolder folder;
};

/// One minute of a flight as the simulator reports it; the same at every call.
Report minute_of_flight(const std::vector<Picture>& contact_sheets, const std::vector<Picture>& footprints) {
  Series height{"flown", {}}, commanded{"commanded", {}, true}, yaw{"yaw", {}}, pitch{"pitch", {}}, roll{"roll", {}},
      airspeed{"airspeed", {}}, ground_speed{"over ground", {}}, optical{"optical", {}}, radar{"radar", {}},
      optical_valid{"optical", {}}, radar_valid{"radar", {}};
  for (int i = 0; i <= 60 * 100; ++i) {
    const double t = i / 100.0, turn = 1 / (1 + std::exp(-(t - 25) * 0.8)),
                 gust = std::sin(1.7 * t) * std::sin(0.31 * t);
    const double target = t < 40 ? 3000 : 3050;
    height.points.push_back({t, t < 40 ? 3000 + 2.5 * gust : 3050 - 50 * std::exp(-(t - 40) / 5) + 2.5 * gust});
    commanded.points.push_back({t, target});
    yaw.points.push_back({t, 90 - 90 * turn + gust});
    pitch.points.push_back({t, 2.1 + 0.6 * gust + (t > 40 ? 6 * std::exp(-(t - 40) / 4) : 0)});
    roll.points.push_back({t, -28 * std::exp(-(t - 25) * (t - 25) / 8) + 1.2 * gust});
    airspeed.points.push_back({t, 25 + 0.4 * gust - (t > 40 ? 1.2 * std::exp(-(t - 40) / 6) : 0)});
    ground_speed.points.push_back({t, 30 - 7 * turn + 0.5 * gust});
  }
  Histogram cost{"Cost of a frame", "frame cost / ms", {}};
  for (int i = 0; i < 600; ++i) {
    const double t = i / 10.0, ms = 24 + 3 * std::sin(0.9 * t) + (i * 7919 % 101) / 30.0 +
                                    (i == 0        ? 160
                                     : i % 97 == 0 ? 30
                                                   : 0);
    optical.points.push_back({t, ms});
    cost.values.push_back(ms);
    optical_valid.points.push_back({t, t > 52 ? std::max(0.62, 1 - (t - 52) * 0.06) : 1});
    if (i % 5 != 0) continue;
    const bool off = t > 31 && t < 36;
    radar.points.push_back({t, off ? nan : 6 + (i * 31 % 17) / 20.0});
    radar_valid.points.push_back({t, off ? nan : 1});
  }
  using enum Figure::State;
  return {
      "Flight of plane1 over Sentinel-2 and Sentinel-1, Spain",
      "One minute from 38.10° N, 0.76° W at 3000 m above ground; optical 1280 × 720 at 10 Hz, radar 256 × 256 at 2 Hz",
      {{"frames", "720", "", "600 optical, 120 radar", Good},
       {"frames a second", "38.4", "/s", "3.5 times as fast as the flight"},
       {"frame cost, median", "25.6", "ms", "95 % within 29.1 ms"},
       {"height error, RMS", "1.3", "m", "largest 50 m, at the step"},
       {"cross-track error, RMS", "0.8", "m", "largest 6.2 m, in the turn", Good},
       {"valid pixels, least", "62", "%", "the map ends 0.4 km east of the path", Warn}},
      {{"What the cameras saw",
        "Frames chosen evenly from the flight. Choose a picture to see it in full size.",
        {contact_sheets.begin(), contact_sheets.end()}},
       {"Where it looked", "", {footprints.begin(), footprints.end()}},
       {"The flight",
        "",
        {Chart{"Height", "height above ground / m", {height, commanded}},
         Chart{"Airspeed", "speed / m/s", {airspeed, ground_speed}, {{"stall speed 18 m/s", 18}}},
         Chart{"Attitude", "angle / °", {pitch, roll}}, Chart{"Heading", "yaw / °", {yaw}}}},
       {"The frames",
        "",
        {Chart{"Frame cost", "time a frame / ms", {optical, radar}, {{"budget 100 ms", 100}}}, cost,
         Chart{"Valid pixels", "part of the frame", {optical_valid, radar_valid}}}},
       {"The plan",
        "How the first frame was made; the same plan served the others.",
        {List{"Done",
              {"optical: spain_s2.tif, EPSG:4326, 3 of 4 bands as uint8",
               "optical: one homography, off by 1.6e-05 px where checked (tolerance 0.05 px)",
               "optical: levels 0 to 0 of 6, filter mip, 1.00 samples a pixel, 9 cells, 240 blocks",
               "radar: averaged in power, written in dB"}},
         List{"Left out",
              {"terrain: the surface is a plane", "lens undistortion: the camera is an ideal pinhole",
               "optical: 1 band: not asked for", "optical: levels coarser than 0: no pixel is that coarse"}},
         Table{"Sensors",
               {"sensor", "map", "resolution", "frames", "median", "95 %", "bytes read"},
               {{"optical", "spain_s2.tif", "10 m", "600", "25.6 ms", "29.1 ms", "41.2 MiB"},
                {"radar", "spain_s1.tif", "10 m", "120", "6.4 ms", "6.8 ms", "3.9 MiB"}}}}}}};
}

// ---- Text

TEST_F(ReportTest, EveryTextIsEscaped) {
  const std::string evil = "<script>alert(\"a\" & 'b')</script>",
                    safe = "&lt;script&gt;alert(&quot;a&quot; &amp; &#39;b&#39;)&lt;/script&gt;";
  const Report report{
      evil,
      evil,
      {{evil, evil, evil, evil}, {}},
      {{evil,
        evil,
        {Picture{small_png("p.png", ""), evil}, Chart{evil, evil, {{evil, {{0, 0}, {1, 1}}}}, {{evil, 0.5}}, evil},
         Histogram{evil, evil, {1, 2}, evil}, Table{evil, {evil}, {{evil}}}, List{evil, {evil}}}},
       {"second", "", {}}}};
  const std::string html = page(report);
  EXPECT_EQ(count(html, "<script"), 1u) << "only our own";
  EXPECT_EQ(html.find("alert(\""), std::string::npos);
  // title, heading, subtitle; 4 of the figure; link, heading and text of the section; picture three times;
  // chart: title twice, labels, series, reference; histogram: title twice, label, unit and in two bars; table 3; list 2
  EXPECT_EQ(count(html, safe), 3u + 4 + 3 + 3 + 6 + 6 + 3 + 2);
}

TEST_F(ReportTest, BytesThatAreNoTextBecomeReplacementCharacters) {
  const std::string replaced = "\xef\xbf\xbd";
  const std::pair<std::string, std::string> cases[] = {
      {"a\x01z", "a" + replaced + "z"},
      {"a\xffz", "a" + replaced + "z"},
      {"a\xc3", "a" + replaced},                                       // cut
      {"a\xc0\xafz", "a" + replaced + replaced + "z"},                 // '/' in two bytes
      {"a\xed\xa0\x80z", "a" + replaced + replaced + replaced + "z"},  // half of a surrogate pair
      {"a\xef\xbf\xbfz", "a" + replaced + replaced + replaced + "z"},  // U+FFFF, which XML forbids
      {"α → \xf0\x9f\x9b\xa9", "α → \xf0\x9f\x9b\xa9"},
  };
  for (const auto& [text, wanted] : cases)
    EXPECT_EQ(between(page(Report{text}), "<title>", "</title>"), wanted) << text;
}

// ---- The page as a whole

TEST_F(ReportTest, SameReportGivesTheSameBytes) {
  const std::vector<Picture> pictures{{small_png("p.png", "pixels"), "sheet"}};
  EXPECT_EQ(page(minute_of_flight(pictures, pictures)), page(minute_of_flight(pictures, pictures)));
}

TEST_F(ReportTest, RefersToNothingOutsideThePage) {
  const std::string html = page(minute_of_flight({{small_png("p.png", "pixels"), "sheet"}}, {}));
  for (const char* word : {"http:", "https:", "url(", "@import", "<link", "fetch(", "srcset"})
    EXPECT_EQ(html.find(word), std::string::npos) << word;
  const std::regex reference(R"re((?:src|href)="([^"]{0,6}))re");
  std::size_t references = 0;
  for (std::sregex_iterator it(html.begin(), html.end(), reference), none; it != none; ++it, ++references) {
    const std::string target = (*it)[1];
    EXPECT_TRUE(target.starts_with("data:") || target.starts_with("#")) << target;
  }
  EXPECT_EQ(references, 1u + 5) << "a picture and a link to each section";
}

TEST_F(ReportTest, MinuteOfFlightWithTwoContactSheetsStaysBelowSixMegabytes) {
  // NADIR_REPORT_SAMPLE: a folder with contact_*.png and footprints_*.png, where the page is left to be looked at
  const char* sample = std::getenv("NADIR_REPORT_SAMPLE");
  if (sample != nullptr) {
    std::vector<Picture> sheets, maps;
    std::set<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(sample)) files.insert(entry.path());
    for (const auto& file : files) {
      if (file.filename().string().starts_with("contact_")) sheets.push_back({file, file.stem().string().substr(8)});
      if (file.filename().string().starts_with("footprints_"))
        maps.push_back({file, file.stem().string().substr(11) + ": path and footprints"});
    }
    ASSERT_TRUE(write_report(std::filesystem::path(sample) / "report.html", minute_of_flight(sheets, maps)));
  }
  // Sheets as large as those of 24 real frames
  const std::string pixels(2'000'000, 'x');
  const std::string html =
      page(minute_of_flight({{small_png("a.png", pixels), "a"}, {small_png("b.png", pixels), "b"}}, {}));
  EXPECT_LT(html.size(), 6'000'000u);
  EXPECT_GT(html.size(), 2 * pixels.size() * 4 / 3) << "the pictures are not in it";
}

TEST_F(ReportTest, EveryPlotIsWellFormedXml) {
  Report report = minute_of_flight({}, {});
  report.sections.push_back(
      {"odd ones",
       "",
       {Chart{"a < b & \"c\"", "'y'", {{"<s>", {{0, 1}, {1, infinity}, {2, 3}}}}, {{"</svg>", 2}}},
        Chart{"none", "y", {}}, Histogram{"h", "x", {}}, Histogram{"<&>", "x", {1, 1, 2, 100, nan}, "<frames>"}}});
  const auto plots = plots_of(page(report));
  ASSERT_EQ(plots.size(), 7u + 4);
  for (const std::string& plot : plots) EXPECT_EQ(xml_fault(plot), "");
}

TEST(XmlFault, FindsWhatWouldBreakAParser) {
  EXPECT_EQ(xml_fault("<a b=\"1\"><c/>x &lt; y</a>"), "");
  for (const char* bad : {"<a>", "<a></b>", "<a b=1/>", "<a b=\"<\"/>", "<a>&</a>", "<a>&nbsp;</a>", "<a/><a/>",
                          "<a b=\"1\" b=\"2\"/>", "<a", "<a>></a>"})
    EXPECT_NE(xml_fault(bad), "") << bad;
}

TEST_F(ReportTest, DiskFullLeavesTheOldPage) {
  folder.write("report.html", "old");
  {
    const test::SmallDisk disk(1000);
    EXPECT_FALSE(write_report(folder.file("report.html"), minute_of_flight({}, {})));
  }
  EXPECT_EQ(test::bytes_of(folder.file("report.html")), "old");
}

// ---- Pictures

TEST_F(ReportTest, EmbeddedPicturesDecodeToTheFilesBytes) {
  for (std::size_t length = 0; length < 4; ++length) {  // every padding
    std::string rest;
    for (std::size_t i = 0; i < 256 + length; ++i) rest += static_cast<char>(i * 37);
    const std::string file = small_png("p.png", rest);
    const std::string html = page(Picture{file, "caption"});
    EXPECT_NE(html.find("width=\"3\" height=\"2\""), std::string::npos);

    const std::string coded = between(html, "data:image/png;base64,", "\"");
    ASSERT_EQ(coded.size() % 4, 0u);
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string decoded;
    unsigned bits = 0, bit_count = 0;
    for (const char digit : coded.substr(0, coded.find('='))) {
      bits = bits << 6 | static_cast<unsigned>(digits.find(digit));
      bit_count += 6;
      if (bit_count < 8) continue;
      bit_count -= 8;
      decoded += static_cast<char>(bits >> bit_count & 0xff);
    }
    EXPECT_EQ(decoded, test::bytes_of(file)) << "length " << length;
  }
}

TEST_F(ReportTest, PictureThatIsNoneIsAnErrorThatNamesItAndNothingIsWritten) {
  const std::string whole = test::bytes_of(small_png("whole.png", ""));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::string file = folder.write("cut.png", whole.substr(0, length));
    const auto written = write_report(folder.file("new.html"), {"t", "", {}, {{"s", "", {Picture{file, ""}}}}});
    ASSERT_FALSE(written) << length;
    EXPECT_EQ(written.error().kind, Error::Kind::Malformed);
    EXPECT_NE(written.error().message.find("cut.png"), std::string::npos);
  }
  const auto missing =
      write_report(folder.file("new.html"), {"t", "", {}, {{"s", "", {Picture{folder.file("none.png"), ""}}}}});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, Error::Kind::NotFound);
  EXPECT_FALSE(std::filesystem::exists(folder.file("new.html")));
}

// ---- Charts

TEST_F(ReportTest, OneSampleSpikesSurviveDecimationWhereverTheyAre) {
  constexpr int samples = 100'000;
  for (const int at : {0, 1, 266, 267, 50'000, samples - 2, samples - 1}) {  // a stretch has 266 or 267 samples
    std::vector<ChartPoint> points;
    for (int i = 0; i < samples; ++i)
      points.push_back({i * 0.01, i == at ? 1000 : i == samples - 1 - at ? -1000 : std::sin(i * 0.001)});
    const auto runs = drawn(points);
    ASSERT_EQ(runs.size(), 1u);
    EXPECT_LE(runs[0].size(), 1500u);
    EXPECT_GE(runs[0].size(), 750u) << "a stretch that only rises has two points, and there are 375";
    const auto [top, bottom] =
        std::minmax_element(runs[0].begin(), runs[0].end(), [](auto& a, auto& b) { return a.y < b.y; });
    // A margin of 6 % at both ends: 1000 * 0.06 / 1.12
    EXPECT_NEAR(top->y, 53.57, 0.01);
    EXPECT_NEAR(bottom->y, 1000 - 53.57, 0.01);
    EXPECT_NEAR(top->x, 1000.0 * at / (samples - 1), 0.01);
    EXPECT_TRUE(std::is_sorted(runs[0].begin(), runs[0].end(), [](auto& a, auto& b) { return a.x < b.x; }));
  }
}

TEST_F(ReportTest, SeriesOfUpToFifteenHundredPointsIsDrawnWhole) {
  std::vector<ChartPoint> points;
  for (int i = 0; i < 1500; ++i) points.push_back({double(i), double(i * i % 97)});
  EXPECT_EQ(drawn(points).at(0).size(), 1500u);
}

TEST_F(ReportTest, NanBreaksTheLine) {
  const auto runs = drawn({{0, 1}, {1, 2}, {2, nan}, {3, 4}, {4, 5}, {5, 6}});
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].size(), 2u);
  EXPECT_EQ(runs[1].size(), 3u);
  EXPECT_NEAR(runs[1][0].x, 600, 0.01);
}

TEST_F(ReportTest, NanBreaksTheLineOfADecimatedSeriesToo) {
  std::vector<ChartPoint> points;
  for (int i = 0; i < 100'000; ++i)
    points.push_back({double(i), i == 30'000 || i == 70'123 ? nan : std::sin(i * 0.001)});
  EXPECT_EQ(drawn(points).size(), 3u);
  for (std::size_t i = 0; i < points.size(); i += 2) points[i].y = nan;
  const auto dots = drawn(points);
  EXPECT_LE(dots.size(), 1500u);
  for (const Stroke& dot : dots) EXPECT_EQ(dot.size(), 1u);
}

TEST_F(ReportTest, PointWithoutNeighboursIsADot) {
  const std::string html = page(Chart{"c", "y", {{"a", {{5, 7}}}}});
  EXPECT_EQ(between(html, "<path class=\"dots c0\" d=\"", "\""), "M500 500h0")
      << "in the middle: there is nothing to be to the left of";
  const std::string one_of_three = page(Chart{"c", "y", {{"a", {{0, 0}, {1, nan}, {2, 1}, {3, 1}}}}});
  EXPECT_EQ(count(between(one_of_three, "<path class=\"dots c0\" d=\"", "\""), "M"), 1u);
  EXPECT_EQ(count(page(Chart{"c", "y", {{"a", {{0, 0}, {1, 1}}}}}), "<path class=\"dots"), 0u);
}

TEST_F(ReportTest, ConstantSeriesLiesInTheMiddleWhateverItsRounding) {
  for (const double value : {0.0, 1.0, -3000.0, 1e-300, 1e289, -1e289}) {
    const auto runs = drawn({{0, value}, {1, value * (1 + 1e-15)}, {2, value}});
    ASSERT_EQ(runs.size(), 1u) << value;
    for (const ChartPoint& p : runs[0]) EXPECT_NEAR(p.y, 500, 0.01) << value;
  }
}

TEST_F(ReportTest, InfiniteValuesBreakTheLineAndAreTold) {
  const std::string html = page(Chart{"c", "y", {{"a", {{0, 1}, {1, infinity}, {2, -infinity}, {3, 2}, {4, 1e291}}}}});
  EXPECT_EQ(runs_of(between(html, "<path class=\"line c0\" d=\"", "\"")).size(), 2u);
  EXPECT_NE(html.find("3 values are infinite"), std::string::npos);
  EXPECT_EQ(page(Chart{"c", "y", {{"a", {{0, 1}, {1, nan}, {2, 2}}}}}).find("infinite"), std::string::npos)
      << "a break asked for is no fault";
}

TEST_F(ReportTest, ChartWithoutDataSaysSo) {
  const Chart charts[] = {
      {"c", "y", {}}, {"c", "y", {{"a", {}}}}, {"c", "y", {{"a", {{nan, nan}, {0, infinity}}}}, {{"limit", 3}}}};
  for (const Chart& chart : charts) {
    const std::string html = page(chart);
    EXPECT_EQ(count(html, ">no data</text>"), 1u);
    EXPECT_EQ(count(html, "class=\"rule\""), 0u) << "an axis without data has no numbers";
  }
  const std::string one_of_two = page(Chart{"c", "y", {{"a", {{0, 1}, {1, 2}}}, {"b", {}}}});
  EXPECT_EQ(count(one_of_two, "b (no data)"), 1u);
  EXPECT_EQ(count(one_of_two, ">no data</text>"), 0u);
}

TEST_F(ReportTest, PlacesStayFiniteAtExtremeValues) {
  for (const double scale : {1e-310, 1e-290, 1e-200, 1e-9, 1e9, 1e200, 1e290}) {
    const std::string html =
        page(Chart{"c", "y", {{"a", {{-scale, scale}, {0, -scale}, {scale, 0}}}}, {{"r", scale / 2}}}) +
        page(Histogram{"h", "x", {-scale, 0, scale, scale}});
    for (const std::string& plot : plots_of(html)) {
      EXPECT_EQ(plot.find("nan"), std::string::npos) << scale;
      EXPECT_EQ(plot.find("inf"), std::string::npos) << scale;
    }
    EXPECT_LT(html.size(), 60'000u) << "no axis has more ticks than fit";
  }
}

/// Words at the ticks of the y axis.
std::vector<std::string> y_labels(const std::string& html) {
  std::vector<std::string> labels;
  const std::regex label("<text x=\"0\"[^>]*>([^<]*)<");
  for (std::sregex_iterator it(html.begin(), html.end(), label), none; it != none; ++it) labels.push_back((*it)[1]);
  return labels;
}

TEST_F(ReportTest, TicksAreRoundNumbersInTheRange) {
  using Labels = std::vector<std::string>;
  const auto labels = [&](double low, double high) {
    return y_labels(page(Chart{"c", "height / m", {{"a", {{0, low}, {1, high}}}}}));
  };
  EXPECT_EQ(labels(0, 1), (Labels{"0.0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_EQ(labels(-10, 10), (Labels{"−10", "−5", "0", "5", "10"}));
  EXPECT_EQ(labels(2990, 3060), (Labels{"3000", "3020", "3040", "3060"}));
  EXPECT_EQ(labels(0, 4e9), (Labels{"0", "1", "2", "3", "4"})) << "in units of 10⁹";
  EXPECT_NE(page(Chart{"c", "height / m", {{"a", {{0, 0}, {1, 4e9}}}}}).find("height / m (× 10⁹)"), std::string::npos);
  EXPECT_EQ(labels(1780000000, 1780000060).front(), "1780000000");
  EXPECT_EQ(labels(0, 4e-9).front(), "0") << "and no minus before a zero";
  // The axis spans 1.12 times the range, cut into 2/3 to 7/4 times 5 parts
  for (double high = 1.0; high < 100; high *= 1.03) {
    EXPECT_GE(labels(0, high).size(), 3u) << high;
    EXPECT_LE(labels(0, high).size(), 9u) << high;
  }
}

TEST_F(ReportTest, NumbersBelowAPlotFindRoomOnAPhone) {
  const std::regex label("text-anchor=\"middle\">([^<]*)<");
  for (const double first : {0.0, 1000.0, 1.78e9, -5205000.0}) {
    for (double span = 0.01; span < 1e6; span *= 1.7) {
      const std::string html = page(Chart{"c", "y", {{"a", {{first, 0}, {first + span, 1}}}}});
      std::size_t characters = 0, ticks = 0;
      for (std::sregex_iterator it(html.begin(), html.end(), label), none; it != none; ++it, ++ticks)
        characters += (*it)[1].length() + 1;
      EXPECT_GE(ticks, 1u) << first << " + " << span;
      EXPECT_LE(characters, 55u) << first << " + " << span;  // a minus counts as three here
    }
  }
}

TEST_F(ReportTest, CountsOfAHistogramAreWhole) {
  EXPECT_EQ(y_labels(page(Histogram{"h", "x", {5}})), (std::vector<std::string>{"0", "1"}));
}

TEST_F(ReportTest, ReferenceLineIsInTheRangeOfTheAxis) {
  const std::string html = page(Chart{"c", "y", {{"a", {{0, 10}, {1, 20}}}}, {{"limit", 60}}});
  // 10 to 60 with 6 % at both ends: 60 is at 6 / 112 from the top
  EXPECT_NE(html.find("class=\"reference\" x1=\"0\" x2=\"100%\" y1=\"5.36%\""), std::string::npos);
}

// ---- Histograms and tables

/// What the bars say when pointed at: "10 to 11: 3 frames".
std::vector<std::string> bars(const std::string& html) {
  std::vector<std::string> titles;
  const std::regex title("<title>([^<]*)</title></rect>");
  for (std::sregex_iterator it(html.begin(), html.end(), title), none; it != none; ++it) titles.push_back((*it)[1]);
  return titles;
}

TEST_F(ReportTest, HistogramCountsEachFiniteValueOnce) {
  const auto total = [&](const std::vector<double>& values) {
    int sum = 0;
    for (const std::string& bar : bars(page(Histogram{"h", "x", values})))
      sum += std::stoi(bar.substr(bar.find(": ") + 2));
    return sum;
  };
  EXPECT_EQ(total({}), 0);
  EXPECT_EQ(total({5}), 1);
  EXPECT_EQ(total({5, 5, 5}), 3);
  EXPECT_EQ(total({0, 0, 0}), 3);
  EXPECT_EQ(total({1, 2, nan, 3, infinity, -infinity}), 3);
  for (const double scale : {1e-9, 0.1, 1.0, 1e9}) {
    std::vector<double> edges;  // values that lie on edges of bars
    for (int i = 0; i <= 30; ++i) edges.push_back(i * scale);
    EXPECT_EQ(total(edges), 31) << scale;
  }
}

TEST_F(ReportTest, FewFarValuesDoNotSqueezeAHistogram) {
  std::vector<double> values{5000, 7000};
  for (int i = 0; i < 1000; ++i) values.push_back(20 + i % 10);
  const auto all = bars(page(Histogram{"h", "frame cost / ms", values}));
  ASSERT_EQ(all.size(), 11u) << "ten usual ones and one for the rest";
  EXPECT_TRUE(all.back().ends_with("7000.00: 2 frames")) << all.back();
}

TEST_F(ReportTest, HistogramNamesMedianAndNinetyFifthPercentileByNearestRank) {
  std::vector<double> values;
  for (int i = 1; i <= 100; ++i) values.push_back(i);
  const std::string html = page(Histogram{"h", "x", values});
  EXPECT_NE(html.find("median 50.00<"), std::string::npos);
  EXPECT_NE(html.find("95 % within 95.00<"), std::string::npos);
  EXPECT_NE(html.find("largest 100.00<"), std::string::npos);
}

TEST_F(ReportTest, ColumnsOfNumbersAreSetToTheRight) {
  const std::string html =
      page(Table{"",
                 {"name", "cost", "note", "gap"},
                 {{"a", "12.5 ms", "3 of 4 bands", "7"}, {"b", "−", "5"}, {"7", "-3", "x y", "–"}}});
  EXPECT_EQ(count(html, "<th class=\"number\">"), 1u);
  EXPECT_NE(html.find("<th class=\"number\">gap"), std::string::npos) << "a missing cell and a dash are no words";
  const std::string numbers = page(Table{"", {"cost"}, {{"12.5 ms"}, {"-3 ms"}, {"98 %"}}});
  EXPECT_EQ(count(numbers, "class=\"number\""), 4u);
}

}  // namespace
}  // namespace nadir::record
