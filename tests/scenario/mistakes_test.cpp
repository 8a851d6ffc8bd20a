// What users most likely did where a file is no YAML, a number none, or a key misspelt.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace mistakes_test {

using testing::ElementsAre;
using testing::IsEmpty;

std::string at(const std::string& place, const std::string& message) {
  return "scenario.yaml:" + place + ": error: " + message;
}

TEST(SyntaxMistakes, Brackets) {
  EXPECT_THAT(faults_of("a: [1, {b: 2]\n"), ElementsAre(at("1:8", "this '{' is not closed before the ']'")));
  EXPECT_THAT(faults_of("é: [1,\n  {b: 2\n  ]\n"),
              ElementsAre(at("2:3", "this '{' is not closed before the ']' in line 3")));
  EXPECT_THAT(faults_of("a: {b: 2]\n"), ElementsAre(at("1:9", "']' cannot close the '{'; write '}'")));
  EXPECT_THAT(faults_of("a: {b: 2,\n  c: 3]\n"),
              ElementsAre(at("2:7", "']' cannot close the '{' in line 1; write '}'")));
  EXPECT_THAT(faults_of("a: [1, 2\nb: 3\n"),
              ElementsAre(at("1:4", "this '[' is not closed; line 2 begins something new")));
  EXPECT_THAT(faults_of("a:\n- {b: 1\n- {b: 2}\n"),
              ElementsAre(at("2:3", "this '{' is not closed; line 3 begins something new")));
  EXPECT_THAT(faults_of("a: [1]]\n"), ElementsAre(at("1:7", "']' closes nothing; no '[' is open")));
  // Brackets in comments, quotes, plain texts and block texts are no brackets.
  EXPECT_THAT(faults_of("a: 'x[' # [\nb: don't [x\nc: |\n  [[ \"\nd: [1\n"),
              ElementsAre(at("5:4", "this '[' is not closed")));
}

TEST(SyntaxMistakes, Commas) {
  EXPECT_THAT(faults_of("a: {b: 1 c: 2}\n"),
              ElementsAre(at("1:8", "a second ': ' in one entry; is a comma missing before the key?")));
  EXPECT_THAT(faults_of("{\n \"a\": \"b\"\n \"c\": \"d\"\n}\n"),
              ElementsAre(at("3:2", "a comma is missing before this")));
}

TEST(SyntaxMistakes, Quotes) {
  EXPECT_THAT(faults_of("a: \"b\nc: \"d\"\n"),
              ElementsAre(at("1:4", "this quote is not closed; line 2 begins with a key")));
  EXPECT_THAT(faults_of("a: \"the \"best\" one\"\n"),
              ElementsAre(at("1:10", "text after the closing quote; a quote within the text is written \\\"")));
  EXPECT_THAT(faults_of("a: @b\n"), ElementsAre(at("1:4", "a text that begins with '@' needs quotes")));
}

TEST(SyntaxMistakes, Lines) {
  EXPECT_THAT(faults_of("a:\n  b:2\n  c: 3\n"),
              ElementsAre(at("2:3", "a key needs a colon and a blank after it: 'b: 2'")));
  EXPECT_THAT(faults_of("a:\r\n  b = 2\r\n  c: 3\r\n"),
              ElementsAre(at("2:3", "a key needs a colon and a blank after it: 'b: 2'")));
  EXPECT_THAT(faults_of("a:\n  b 2\n  c: 3\n"),
              ElementsAre(at("2:3", "this line is no 'key: value'; is a colon missing?")));
  EXPECT_THAT(faults_of("a:\n  -b: 2\n  - c: 3\n"),
              ElementsAre(at("2:3", "a '-' that begins a list item needs a blank after it")));
  EXPECT_THAT(faults_of("a: 1\n<<<<<<< HEAD\nb: 2\n=======\nb: 3\n>>>>>>> x\n"),
              ElementsAre(at(
                  "2:1", "the mark of an unresolved merge conflict; keep one of the two sides and remove the marks")));
}

TEST(SyntaxMistakes, Indentation) {
  EXPECT_THAT(faults_of("a:\n  b: 1\n    c: 2\n"),
              ElementsAre(at("3:5", "this line is indented by 4, its neighbour in line 2 by 2")));
  EXPECT_THAT(
      faults_of("a:\n    b: 1\n  c: 2\n"),
      ElementsAre(at("3:3", "this line is indented by 2, which fits no line above: line 1 has 0, line 2 has 4")));
  EXPECT_THAT(faults_of("a:\n  - b: 1\n  c: 2\n"),
              ElementsAre(at("3:3",
                             "a key among list items; indent it as the keys of the item in line 2, or begin an "
                             "item with '- '")));
  EXPECT_THAT(faults_of("a:\n\xc2\xa0 b: 1\n"),
              ElementsAre(at("2:1", "no-break space in the indentation; indent with spaces")));
  EXPECT_THAT(faults_of("a: 1\rb: 2\r"),
              ElementsAre(at("1:5",
                             "a carriage return without a line feed; save the file with line feeds (or Windows "
                             "line ends)")));
}

TEST(NumberMistakes, SuggestCorrections) {
  const std::pair<const char*, const char*> cases[] = {
      {"10,5", "; use a decimal point, write 10.5"},
      {"1,000", "; write 1.000 or 1000"},
      {"1'000", "; digits are not grouped, write 1000"},
      {"1 000 000", "; digits are not grouped, write 1000000"},
      {"-pi/2", "; values are not calculated, write -1.5707963267948966"},
      {"2*10", "; values are not calculated, write 20"},
      {"1O", "; did you mean 10?"},
      {"1D-3", "; did you mean 1e-3?"},
      {"20 // s", "; comments begin with '#'"},
      {"twenty", ""},
      {"inf", ""},
      {"2*", ""},
  };
  for (const auto& [text, advice] : cases) {
    EXPECT_THAT(faults_of(edited(kSmallScenario, {{"duration: 20", std::string("duration: ") + text}})),
                ElementsAre(at("31:13", "approach.duration must be a number [s], not the text '" + std::string(text) +
                                            "'" + advice)));
  }
}

TEST(NumberMistakes, TooSmallIsNotTooLarge) {
  const auto why = [](const std::string& number) {
    return faults_of(edited(kSmallScenario, {{"duration: 20", "duration: " + number}})).at(0);
  };
  for (const char* tiny : {"1e-400", "0.001e-398", "1e-99999999999999999999"})
    EXPECT_THAT(why(tiny), testing::EndsWith("is below the range of a double"));
  for (const char* huge : {"1e400", "0.001e+400", "1e99999999999999999999"})
    EXPECT_THAT(why(huge), testing::EndsWith("is above the range of a double"));
}

TEST(NumberMistakes, DecimalCommasInLists) {
  EXPECT_THAT(
      faults_of(edited(kSmallScenario, {{"{shoulder: 0.5, ", "{shoulder: 0,5, "}})),
      ElementsAre(at(
          "20:22",
          "initial.joints.shoulder must be a number [rad or m], not the text '0,5'; use a decimal point, write 0.5")));
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"position: [2, 0, 0]", "position: [2,5, 0, 0]"}})),
              ElementsAre(at("25:23",
                             "targets[0].state.position has 4 items, must have exactly 3; is '2,5' one number? It "
                             "needs a point")));
}

TEST(KeySlips, AreOneFaultEach) {
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"targets:", "target:"}, {"  duration: 20", "  Duration: 0"}})),
              ElementsAre(at("21:1", "unknown key 'target' in the scenario; did you mean 'targets'?"),
                          at("31:3", "unknown key 'Duration' in approach; did you mean 'duration'?"),
                          // What it holds is checked as what was meant.
                          at("31:13", "approach.duration is 0, must be greater than 0 [s]")));
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"{shoulder: 0.5, elbow: 1}", "{shoulder:0.5, elbow: 1}"}})),
              ElementsAre(at("20:12", "a key needs a colon and a blank after it: 'shoulder: 0.5'")));
  // A key that is there already is not given again, nor one that cannot hold the value.
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"  duration: 20", "  duration: 20\n  duratio: 0"}})),
              ElementsAre(at("32:3", "unknown key 'duratio' in approach; did you mean 'duration'?")));
}

}  // namespace mistakes_test
}  // namespace grapnel::test
