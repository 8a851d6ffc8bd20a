// Files that cannot be read, are no YAML, or are made to harm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace file_faults_test {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(FileFaults, Missing) {
  const TemporaryFolder folder;
  folder.write("capture.yaml", kSmallScenario);
  EXPECT_THAT(faults_of_file(folder.path() / "captur.yaml"),
              ElementsAre("captur.yaml: error: cannot read the file: no such file; did you mean 'capture.yaml'?"));
  EXPECT_THAT(faults_of_file(folder.path() / "no" / "folder.yaml"),
              ElementsAre("folder.yaml: error: cannot read the file: no such file"));
  EXPECT_THAT(faults_of_file(folder.path() / "capture.yaml" / "x"),
              ElementsAre("x: error: cannot read the file: Not a directory"));
}

TEST(FileFaults, Directory) {
  const TemporaryFolder folder;
  EXPECT_THAT(faults_of_file(folder.path() / "."),
              ElementsAre(testing::EndsWith("error: cannot read the file: it is a directory")));
}

TEST(FileFaults, NotPermitted) {
  const TemporaryFolder folder;
  const auto path = folder.write("secret.yaml", kSmallScenario);
  std::filesystem::permissions(folder.path(), static_cast<std::filesystem::perms>(0755));
  std::filesystem::permissions(path, std::filesystem::perms::none);
  // Root may read everything: switch to the user nobody temporarily.
  const uid_t user = geteuid();
  if (user == 0) {
    ASSERT_EQ(seteuid(65534), 0);
  }
  const auto faults = faults_of_file(path);
  ASSERT_EQ(seteuid(user), 0);
  EXPECT_THAT(faults, ElementsAre("secret.yaml: error: cannot read the file: Permission denied"));
}

TEST(FileFaults, Empty) {
  for (const char* text : {"", "\n\n", "# only a comment\n", "---\n", "~\n", "\xef\xbb\xbf"}) {
    EXPECT_THAT(faults_of(text), ElementsAre("scenario.yaml:1:1: error: the file is empty")) << text;
  }
}

TEST(FileFaults, Huge) {
  const TemporaryFolder folder;
  const auto path = folder.write("huge.yaml", "name: x\n");
  std::filesystem::resize_file(path, (16u << 20) + 1);  // sparse
  EXPECT_THAT(faults_of_file(path), ElementsAre("huge.yaml: error: cannot read the file: it is larger than 16 MB"));
  // A device has no size; reading stops.
  EXPECT_THAT(faults_of_file("/dev/zero"), ElementsAre("zero: error: cannot read the file: it is larger than 16 MB"));
}

TEST(FileFaults, NotUtf8) {
  EXPECT_THAT(faults_of("name: caf\xe9\n"),
              ElementsAre("scenario.yaml:1:10: error: the file is not UTF-8 (byte 0xe9)"));
  EXPECT_THAT(faults_of("name: x\n# \xc3\xa9 \xc0\x80\n"),
              ElementsAre("scenario.yaml:2:5: error: the file is not UTF-8 (byte 0xc0)"));
  EXPECT_THAT(faults_of("name: \xed\xa0\x80"),
              ElementsAre("scenario.yaml:1:7: error: the file is not UTF-8 (byte 0xed)"));
  EXPECT_THAT(faults_of("\xff\xfen\0a\0"),
              ElementsAre("scenario.yaml:1:1: error: the file is UTF-16; save it as UTF-8"));
  EXPECT_THAT(faults_of(std::string_view("name: a\0b", 9)),
              ElementsAre("scenario.yaml:1:8: error: control character 0x00 is not allowed in the file"));
  EXPECT_THAT(faults_of("name: a\x04z"),
              ElementsAre("scenario.yaml:1:8: error: control character 0x04 is not allowed in the file"));
}

TEST(FileFaults, WindowsTextIsFine) {
  std::string text = "\xef\xbb\xbf";
  for (const char* c = kSmallScenario; *c != '\0'; ++c) text += *c == '\n' ? std::string("\r\n") : std::string(1, *c);
  EXPECT_THAT(faults_of(text), IsEmpty());
  EXPECT_THAT(faults_of(edited(text, {{"duration: 20\r", "duration: 0\r"}})),
              ElementsAre("scenario.yaml:31:13: error: approach.duration is 0, must be greater than 0 [s]"));
}

TEST(FileFaults, AnchorsAndTagsAreFine) {
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"inertia: [1, 1, 1]", "inertia: !tensor &i [1, 1, 1]"},
                                                {"position: [2, 0, 0]", "position: *i"},
                                                {"duration: 20", "duration: !seconds 20"}})),
              IsEmpty());
  // !!str makes text of a number, as quotes do.
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"name: test", "name: !!str 12"}})), IsEmpty());
}

TEST(FileFaults, ErrorInAnAliasIsReportedOnce) {
  EXPECT_THAT(
      faults_of(edited(kSmallScenario, {{"position: [2, 0, 0]", "position: &p [2, 0]"},
                                        {"grip, position: [0, 0.5, 0]", "grip, position: *p"}})),
      ElementsAre("scenario.yaml:25:23: error: targets[0].state.position has 2 items, must have exactly 3",
                  "scenario.yaml:25:23: error: targets[0].grasp_points[0].position has 2 items, must have exactly 3"));
}

TEST(FileFaults, SeveralDocuments) {
  EXPECT_THAT(faults_of(std::string(kSmallScenario) + "---\nname: second\n"),
              ElementsAre("scenario.yaml:36:1: error: a second document in the file; only one is allowed"));
  EXPECT_THAT(faults_of("---\n" + std::string(kSmallScenario) + "...\n"), IsEmpty());
}

TEST(FileFaults, Tabs) {
  EXPECT_THAT(faults_of("name: x\ninitial:\n\tjoints: {}\n  \tbase: {}\n"),
              ElementsAre("scenario.yaml:3:1: error: tab in the indentation; indent with spaces",
                          "scenario.yaml:4:3: error: tab in the indentation; indent with spaces"));
  EXPECT_THAT(
      faults_of(edited(kSmallScenario, {{"duration: 20", "duration:\t20\t# tabs here are fine\n\t# and here"}})),
      IsEmpty());
}

TEST(FileFaults, Syntax) {
  EXPECT_THAT(faults_of("name: a: b\n"),
              ElementsAre("scenario.yaml:1:7: error: a second ': ' in one line; put a text that holds it in quotes, or "
                          "begin a new line for a new key"));
  EXPECT_THAT(faults_of("name: x\nrobot: \"unclosed\n"),
              ElementsAre("scenario.yaml:2:8: error: this quote is not closed"));
  EXPECT_THAT(faults_of("name: x\nrobot: !tag 'it''s unclosed\n"),
              ElementsAre("scenario.yaml:2:13: error: this quote is not closed"));
  EXPECT_THAT(faults_of("name: [1, 2\n"), ElementsAre("scenario.yaml:1:7: error: this '[' is not closed"));
  EXPECT_THAT(faults_of(edited(kSmallScenario, {{"name: test", "name: &n 'it''s \"open\"'"}, {"20", "20 # isn't"}})),
              IsEmpty());
  EXPECT_THAT(faults_of("gravity: *unknown\n"),
              ElementsAre("scenario.yaml:1:10: error: not valid YAML: the referenced anchor is not defined"));
  EXPECT_THAT(faults_of("a: &r [1, *r]\n"),
              ElementsAre("scenario.yaml:1:11: error: the alias is inside the value that it refers to"));
  EXPECT_THAT(faults_of("[a, b]: c\n"),
              ElementsAre("scenario.yaml:1:1: error: a list or mapping in place of a key; is a bracket not closed?"));
  EXPECT_THAT(faults_of("- 1\n- 2\n"),
              ElementsAre("scenario.yaml:1:1: error: the scenario must be a mapping, not a list"));
  EXPECT_THAT(faults_of("just words\n"),
              ElementsAre("scenario.yaml:1:1: error: the scenario must be a mapping, not the text 'just words'"));
}

TEST(FileFaults, FileOfTheOtherKind) {
  EXPECT_THAT(faults_of("schema: grapnel-robot/1\nname: r\n"),
              ElementsAre("scenario.yaml:1:9: error: this is a robot file where a scenario is expected"));
  EXPECT_THAT(robot_faults_of("schema: grapnel-scenario/1\n"),
              ElementsAre("robot.yaml:1:9: error: this is a scenario file where a robot is expected"));
}

TEST(FileFaults, TenThousandLevels) {
  constexpr int kLevels = test::repetitions(10'000);
  const std::string flow = std::string(kLevels, '[') + std::string(kLevels, ']');
  EXPECT_THAT(faults_of("gravity: " + flow), ElementsAre("scenario.yaml:1:73: error: nested deeper than 64 levels"));
  std::string flow_lines;
  for (int i = 0; i < kLevels; ++i) flow_lines += "{a:\n ";
  flow_lines += std::string(kLevels, '}');
  EXPECT_THAT(faults_of(flow_lines), ElementsAre(testing::EndsWith("error: nested deeper than 64 levels")));
  std::string block;
  for (int i = 0; i < test::repetitions(4000); ++i) block += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_THAT(faults_of(block), ElementsAre("scenario.yaml:65:65: error: nested deeper than 64 levels"));
  std::string dashes;
  for (int i = 0; i < kLevels; ++i) dashes += "- ";
  EXPECT_THAT(faults_of(dashes), ElementsAre("scenario.yaml:1:129: error: nested deeper than 64 levels"));
}

TEST(FileFaults, BillionLaughs) {
  std::string wide = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 12; ++i) {
    const std::string below = "*a" + std::to_string(i - 1);
    wide += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + below;
    for (int k = 1; k < 10; ++k) wide += ", " + below;
    wide += "]\n";
  }
  EXPECT_THAT(faults_of(wide), ElementsAre(testing::EndsWith("error: more than 500000 values (aliases expanded)")));
  std::string deep = "a0: &a0 [x]\n";
  for (int i = 1; i < 1000; ++i)
    deep += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [*a" + std::to_string(i - 1) + "]\n";
  EXPECT_THAT(faults_of(deep), ElementsAre(testing::EndsWith("error: nested deeper than 64 levels")));
}

TEST(FileFaults, MillionsOfValues) {
  SKIP_UNDER_SANITIZERS();
  std::string text = "gravity: [1";
  while (text.size() < (2u << 20)) text += ",1";
  EXPECT_THAT(faults_of(text + "]\n"),
              ElementsAre(testing::EndsWith("error: more than 500000 values (aliases expanded)")));
}

}  // namespace file_faults_test
}  // namespace grapnel::test
