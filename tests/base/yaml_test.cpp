#include "nadir/base/yaml.h"

#include <gtest/gtest.h>

namespace nadir {
namespace {

YamlMap parse(const std::string& text) { return YamlMap::parse("f.yaml", text).value(); }

/// What `finish` says; empty where the file is good.
std::string faults(const YamlMap& map) {
  const auto done = map.finish();
  return done ? "" : done.error().message;
}

std::string refusal(const std::string& text) {
  const auto map = YamlMap::parse("f.yaml", text);
  return map ? "accepted" : map.error().message;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(YamlMap, WhatWasAskedForIsGood) {
  const YamlMap map = parse("a: 1.5\nb: yes\nc: [1, 2]\nd: {e: text}\nf: [{g: 1}, {g: 2}]\nh: 9007199254740\n");
  EXPECT_EQ(map.number("a"), 1.5);
  EXPECT_EQ(map.flag("b"), true);
  EXPECT_EQ(map.numbers("c"), (std::vector<double>{1, 2}));
  EXPECT_EQ(map.map("d")->text("e"), "text");
  const std::vector<YamlMap> items = map.maps("f");
  ASSERT_EQ(items.size(), 2u);
  for (const YamlMap& item : items) EXPECT_TRUE(item.number("g"));
  EXPECT_EQ(map.integer("h"), 9007199254740);
  EXPECT_EQ(map.number("missing"), std::nullopt);
  EXPECT_EQ(faults(map), "") << "a key that may be there need not be";
}

TEST(YamlMap, AKeyNeverAskedForIsAFaultWithItsLineAndTheNearestName) {
  const YamlMap map = parse("seed: 1\nscene:\n  groudn: 3\n");
  map.number("seed");
  map.map("scene")->number("ground");
  EXPECT_EQ(faults(map), "f.yaml:3: unknown key 'scene.groudn'; did you mean 'ground'?");
}

TEST(YamlMap, AMapThatNobodyLooksIntoIsOneFaultAndNotMany) {
  const YamlMap map = parse("good: 1\nother:\n  x: 1\n  y: 2\n");
  map.number("good");
  EXPECT_EQ(faults(map), "f.yaml:2: unknown key 'other'; known are good");
}

TEST(YamlMap, AllFaultsAreToldInTheOrderOfTheirLines) {
  const YamlMap map = parse("a: x\nb:\n  c: 1.5\n  zz: 1\nd: [1, y]\na: 2\n");
  map.numbers("d");  // asked for in another order than written
  map.map("b")->integer("c");
  map.number("a");
  map.require("e");
  EXPECT_EQ(faults(map),
            "f.yaml:1: 'a': expected a number, found 'x'\n"
            "f.yaml:1: expected the key 'e'\n"
            "f.yaml:3: 'b.c': expected a whole number, found 1.5\n"
            "f.yaml:4: unknown key 'b.zz'; known are c\n"
            "f.yaml:5: 'd': expected finite numbers, found 'y'\n"
            "f.yaml:6: the key 'a' is there twice");
}

TEST(YamlMap, AValueOfTheWrongKindGivesNothingAndAFault) {
  const std::string text = "scalar: 1\nlist: [1]\nmap: {a: 1}\nmaps: [{a: 1}]\n";
  const auto fault_of = [&](auto get) {
    const YamlMap map = parse(text);
    for (const char* key : {"scalar", "list", "map", "maps"}) map.has(key);  // known
    EXPECT_FALSE(get(map));
    return faults(map);
  };
  EXPECT_EQ(fault_of([](const YamlMap& m) { return m.text("list"); }), "f.yaml:2: 'list': expected a single value");
  EXPECT_EQ(fault_of([](const YamlMap& m) { return m.number("map"); }), "f.yaml:3: 'map': expected a single value");
  EXPECT_EQ(fault_of([](const YamlMap& m) { return m.flag("scalar"); }),
            "f.yaml:1: 'scalar': expected true or false, found '1'");
  EXPECT_TRUE(
      contains(fault_of([](const YamlMap& m) { return m.numbers("scalar"); }), "f.yaml:1: 'scalar': expected a list"));
  EXPECT_TRUE(
      contains(fault_of([](const YamlMap& m) { return m.texts("maps"); }), "f.yaml:4: 'maps': expected a list"));
  EXPECT_TRUE(
      contains(fault_of([](const YamlMap& m) { return m.map("list"); }), "f.yaml:2: 'list': expected 'key: value'"));
  EXPECT_TRUE(contains(fault_of([](const YamlMap& m) { return !m.maps("list").empty(); }),
                       "f.yaml:2: 'list': expected a list of maps"));
}

TEST(YamlMap, NumbersThatAreNotFiniteAreRefused) {
  for (const char* bad : {".inf", "-.inf", ".nan", "inf", "nan", "1e999", "0x10", "1_000", "''"}) {
    const YamlMap map = parse(std::string("a: ") + bad + "\n");
    EXPECT_EQ(map.number("a"), std::nullopt) << bad;
    EXPECT_TRUE(contains(faults(map), "f.yaml:1: 'a': expected a number")) << bad;
    const YamlMap list = parse(std::string("a: [1, ") + bad + "]\n");
    EXPECT_EQ(list.numbers("a"), std::nullopt) << bad;
    EXPECT_TRUE(contains(faults(list), "finite numbers")) << bad;
  }
}

TEST(YamlMap, WholeNumbersThatADoubleWouldRoundAreRefused) {
  EXPECT_EQ(parse("a: 8999999999999999\n").integer("a"), 8999999999999999) << "below 2^53 every one is exact";
  const YamlMap map = parse("a: 9007199254740993\n");  // 2^53 + 1 has no double
  EXPECT_EQ(map.integer("a"), std::nullopt);
  EXPECT_NE(faults(map), "");
}

TEST(YamlMap, AnEmptyValueIsMissing) {
  for (const char* empty : {"a:\n", "a: ~\n", "a: null\n"}) {
    const YamlMap map = parse(empty);
    EXPECT_FALSE(map.has("a")) << empty;
    EXPECT_EQ(map.number("a"), std::nullopt) << empty;
    map.require("a");
    EXPECT_EQ(faults(map), "f.yaml:1: expected the key 'a'") << empty;
  }
  EXPECT_EQ(parse("a: 'null'\n").text("a"), "null") << "in quotes it is a text";
}

TEST(YamlMap, NamesThatUsersChooseAreKnownButWhatIsBelowThemIsChecked) {
  const YamlMap map = parse("plane1: {speed: 1}\n'a b': {sped: 2}\n");
  std::vector<std::string> names;
  for (const auto& [name, entry] : map.entries()) {
    names.push_back(name);
    entry.number("speed");
  }
  EXPECT_EQ(names, (std::vector<std::string>{"plane1", "a b"})) << "in the order of the file";
  EXPECT_EQ(faults(map), "f.yaml:2: unknown key 'a b.sped'; did you mean 'speed'?");
}

TEST(YamlMap, NamesThatUsersChooseMustBeNamesOfMapsAndThereOnce) {
  const YamlMap map = parse("a: {}\nb: 1\nc:\n[x, y]: {}\na: {}\n~: {}\n");
  map.entries();
  const std::string message = faults(map);
  for (const char* part :
       {"f.yaml:2: 'b': expected 'key: value'", "f.yaml:3: 'c': expected 'key: value'", "f.yaml:4: expected a name",
        "f.yaml:5: the key 'a' is there twice", "f.yaml:6: expected a name"})
    EXPECT_TRUE(contains(message, part)) << part << "\nin\n" << message;
}

TEST(YamlMap, KeysThatAreNoWordsAreFaultsAndNoCrash) {
  const YamlMap map = parse("? [a, b]\n: 1\n? {c: d}\n: 2\ngood: x\n");
  map.number("good");  // its fault looks for its line among them
  const std::string message = faults(map);
  EXPECT_TRUE(contains(message, "f.yaml:1: unknown key '?'")) << message;
  EXPECT_TRUE(contains(message, "f.yaml:5: 'good': expected a number")) << message;
}

TEST(YamlMap, AMapUsedTwiceByAliasIsCheckedInBothPlaces) {
  const YamlMap map = parse("a: &mount {pitch: 1}\nb: *mount\n");
  EXPECT_EQ(map.map("a")->number("pitch"), 1);
  const auto b = map.map("b");
  EXPECT_TRUE(contains(faults(map), "unknown key 'b.pitch'")) << "nobody asked for it there";
  EXPECT_EQ(b->number("pitch"), 1);
  EXPECT_EQ(faults(map), "");
}

TEST(YamlMap, AliasesThatWouldUnfoldToBillionsCostNothing) {
  std::string text = "l0: &l0 {x: 1}\n";  // 10^12 maps when unfolded, in 13 lines
  for (int i = 1; i <= 12; ++i) {
    std::string items;
    for (int k = 0; k < 10; ++k) items.append(k > 0 ? ", *l" : "*l").append(std::to_string(i - 1));
    const std::string number = std::to_string(i);
    text.append("l").append(number).append(": &l").append(number).append(" [").append(items).append("]\n");
  }
  const YamlMap map = parse(text);
  map.map("l0");
  for (int i = 1; i <= 12; ++i) {
    const std::string key = std::string("l").append(std::to_string(i));
    EXPECT_EQ(map.texts(key), std::nullopt);
    EXPECT_EQ(map.maps(key).size(), i == 1 ? 10u : 0u) << "only the first is a list of maps";
  }
  EXPECT_TRUE(contains(faults(map), "f.yaml:13: 'l12': expected a list"));
}

TEST(YamlMap, AMapThatHoldsItselfIsFollowedOnlyAsFarAsAsked) {
  const YamlMap map = parse("a: &a\n  b: *a\n");
  const auto inner = map.map("a")->map("b")->map("b");
  ASSERT_TRUE(inner);
  EXPECT_EQ(faults(map), "f.yaml:2: unknown key 'a.b.b.b'");
}

TEST(YamlMap, NestingWithoutEndIsRefused) {
  for (const char* open : {"[", "{a: ", "- ", "{? "}) {
    std::string text = "k:\n ";
    for (int i = 0; i < 100'000; ++i) text += open;
    EXPECT_TRUE(contains(refusal(text), "f.yaml:")) << open;
  }
  std::string lines;  // one deeper each
  for (int i = 0; i < 2000; ++i) lines += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_TRUE(contains(refusal(lines), "f.yaml:"));
}

TEST(YamlMap, WhatIsNoMapOrNoYamlIsRefusedWithItsLine) {
  EXPECT_TRUE(contains(refusal(""), "f.yaml:1: expected 'key: value' lines"));
  EXPECT_TRUE(contains(refusal("- 1\n- 2\n"), "f.yaml:1: expected 'key: value' lines"));
  EXPECT_TRUE(contains(refusal("just words\n"), "f.yaml:1: expected 'key: value' lines"));
  EXPECT_TRUE(contains(refusal("a: 1\nb: [1, 2\n"), "expected YAML"));
  EXPECT_TRUE(contains(refusal("a: 1\nb: *nobody\n"), "f.yaml:2: expected YAML"));
  EXPECT_TRUE(contains(refusal("a: 1\n\tb: 2\n"), "f.yaml:2: expected YAML"));
}

TEST(YamlMap, AStrayCommaIsRefusedInsteadOfReadForEver) {
  EXPECT_TRUE(contains(refusal(", a: 1\n"), "expected one document, found another"));
}

TEST(YamlMap, ASecondDocumentIsRefusedInsteadOfIgnored) {
  EXPECT_EQ(refusal("a: 1\n---\nb: 2\n"),
            "f.yaml:2: expected one document, found another: remove the line '---'");
  EXPECT_EQ(refusal("---\na: 1\n"), "accepted") << "a mark at the top is usual";
  EXPECT_EQ(refusal("a: 1\n...\n"), "accepted");
}

TEST(YamlMap, AGoodFileCutAtAnyByteIsReadOrRefused) {
  const std::string text = "a: &x {b: [1, 2], 'c': \"d\\n\"}\ne: *x\n? f\n: |\n  text\ng: !!int 3\n";
  int refused = 0;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const auto map = YamlMap::parse("f.yaml", text.substr(0, n));
    if (map)
      (void)map->entries(), (void)map->finish();
    else
      ++refused;
  }
  EXPECT_GT(refused, 10) << "the cuts no longer damage it";
}

TEST(YamlQuoted, AnyTextComesBackAsItWas) {
  for (const std::string& text : {std::string(""), std::string("plain"), std::string("null"), std::string("~"),
                                  std::string("007"), std::string("a: b # c"), std::string("\"quoted\" \\ 'too'"),
                                  std::string(" edges "), std::string("two\nlines\ttab\r"), std::string("\x01\x7f"),
                                  std::string("Orihuela, España 衛星 🛰"), std::string("{a, [b]}")}) {
    EXPECT_EQ(parse("a: " + yaml_quoted(text) + "\n").text("a"), text);
    EXPECT_EQ(parse("a: {b: [" + yaml_quoted(text) + "]}\n").map("a")->texts("b"), std::vector<std::string>{text})
        << "in a list too";
    if (text.empty()) continue;
    EXPECT_TRUE(parse(yaml_quoted(text) + ": 1\n").has(text)) << "as a key too: " << text;
  }
}

}  // namespace
}  // namespace nadir
