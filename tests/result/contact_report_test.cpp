/// Contacts between shapes in summary.json, on the terminal and in the verdicts.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/result_table_parts.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace contact_report_test {

using nlohmann::json;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// Every number differs.
ContactPairReport touching(const std::string& a, const std::string& b) {
  ContactPairReport pair;
  pair.body_a = a, pair.body_b = b;
  pair.touches = 3, pair.touches_at_end = true, pair.first_time = 2.25, pair.duration = 0.875;
  pair.impulse = 4.5, pair.peak_force = 12.3, pair.peak_time = 2.5, pair.peak_point = {0.1, -0.2, 0.3};
  pair.largest_depth = 1.5e-4, pair.slip_distance = 0.0625;
  pair.damping_loss = 0.75, pair.friction_loss = 0.375, pair.elastic_energy = 0.03125;
  return pair;
}

CaptureResult sample() {
  CaptureResult result;
  result.status = CaptureStatus::completed;
  result.scenario_name = "touching";
  ContactPairReport apart;
  apart.body_a = "base", apart.body_b = "panel";
  ContactPairReport light = touching("finger", "debris");
  light.touches = 1, light.peak_force = 0.5, light.touches_at_end = false;
  result.contacts = {apart, touching("palm", "debris"), light};
  return result;
}

json parsed(const CaptureResult& result) { return json::parse(summary_json(result, "1.2.3")); }

TEST(ContactReport, SummaryHasEveryValueUnderItsKey) {
  const json contacts = parsed(sample()).at("contacts");
  ASSERT_EQ(contacts.size(), 3U);
  const json expected = {{"bodies", {"palm", "debris"}},
                         {"touches", 3},
                         {"touches_at_end", true},
                         {"first_time", 2.25},
                         {"duration", 0.875},
                         {"impulse", 4.5},
                         {"peak_force", 12.3},
                         {"peak_time", 2.5},
                         {"peak_point", {0.1, -0.2, 0.3}},
                         {"largest_depth", 1.5e-4},
                         {"slip_distance", 0.0625},
                         {"damping_loss", 0.75},
                         {"friction_loss", 0.375},
                         {"elastic_energy", 0.03125},
                         {"beyond_model", false}};
  EXPECT_EQ(contacts[1], expected);
  // Without contact there is no time and no point.
  for (const char* key : {"first_time", "peak_time", "peak_point"}) EXPECT_FALSE(contacts[0].contains(key)) << key;
  EXPECT_EQ(contacts[0].at("touches"), 0);
  EXPECT_FALSE(parsed({}).contains("contacts"));
}

TEST(ContactReport, SummaryFollowsTheSchema) {
  const test::SchemaCheck schema(json_schema(type_of<Summary>(), "summary"));
  const json good = parsed(sample());
  EXPECT_THAT(schema.faults_of(good), IsEmpty());
  json bad = good;
  bad["contacts"][1]["peak_force"] = nullptr;
  EXPECT_THAT(schema.faults_of(bad), Not(IsEmpty()));
  bad = good;
  bad["contacts"][1].erase("impulse");
  EXPECT_THAT(schema.faults_of(bad), Not(IsEmpty()));
}

TEST(ContactReport, TableListsThePairsThatTouched) {
  CaptureResult result = sample();
  const std::string text = result_table(result);
  EXPECT_THAT(text, HasSubstr("\ncontacts, 2 of 3 pairs that may touch\n"));
  EXPECT_THAT(text, ContainsRegex("\n  palm, debris +3 +2\\.25 +0\\.875 +4\\.5 +12\\.3 +2\\.5\n"));
  EXPECT_THAT(text, ContainsRegex("\n  palm, debris +0\\.00015 +0\\.0625 +0\\.75 +0\\.375 +0\\.03125 +yes\n"));
  EXPECT_THAT(text, ContainsRegex("\n  finger, debris .* no\n"));
  EXPECT_THAT(text, Not(HasSubstr("panel")));
  EXPECT_THAT(text, Not(HasSubstr("not reliable")));
  result.contacts[1].beyond_model = true;
  EXPECT_THAT(contact_table(result), HasSubstr("  palm, debris *"));
  EXPECT_THAT(contact_table(result), HasSubstr("* an overlap was too deep for the contact model"));
  result.contacts.resize(1);
  EXPECT_EQ(contact_table(result), "\ncontacts, 0 of 1 pairs that may touch\n");
  EXPECT_EQ(contact_table({}), "");
}

TEST(ContactReport, HardPairsHaveTheirImpacts) {
  CaptureResult result = sample();
  ContactPairReport& pair = result.contacts[1];
  pair.hard = HardContactReport{7, 0.25, 3.5, 4.25, 0.625, 0.125, 3.75};
  const json expected = {{"impacts", 7},
                         {"fastest_impact", 0.25},
                         {"last_time", 3.5},
                         {"impulse", 4.25},
                         {"restitution_loss", 0.625},
                         {"friction_loss", 0.125},
                         {"persistent_since", 3.75}};
  const json contacts = parsed(result).at("contacts");
  EXPECT_EQ(contacts[1].at("hard"), expected);
  EXPECT_FALSE(contacts[2].contains("hard"));
  const std::string text = contact_table(result);
  EXPECT_THAT(text, ContainsRegex("\n  palm, debris +7 +3\\.5 +4\\.25 +0\\.625 +0\\.125 +3\\.75\n"));
  EXPECT_THAT(contact_sentence(result),
              HasSubstr("2 of 3 pairs touched; 7 impacts in an instant; largest force 12.3 N"));
  // Of impacts alone there is no force, and no time of the largest one.
  pair.peak_force = 0, result.contacts[2].peak_force = 0, pair.hard->persistent_since.reset();
  EXPECT_FALSE(parsed(result).at("contacts")[1].contains("peak_time"));
  EXPECT_FALSE(parsed(result).at("contacts")[1].at("hard").contains("persistent_since"));
  EXPECT_EQ(contact_sentence(result), "contacts: 2 of 3 pairs touched; 7 impacts in an instant");
}

TEST(ContactReport, TableIsLimited) {
  CaptureResult result;
  for (int i = 0; i < 25; ++i) result.contacts.push_back(touching(std::string(90, 'n'), std::to_string(i)));
  for (ContactPairReport& pair : result.contacts)
    pair.hard = HardContactReport{1000,
                                  -1.23456789e-100,
                                  -1.23456789e-100,
                                  -1.23456789e-100,
                                  -1.23456789e-100,
                                  -1.23456789e-100,
                                  -1.23456789e-100};
  for (ContactPairReport& pair : result.contacts)
    pair.duration = pair.impulse = pair.peak_force = pair.peak_time = pair.largest_depth = pair.slip_distance =
        pair.damping_loss = pair.friction_loss = pair.elastic_energy = -1.23456789e-100;
  const std::string text = contact_table(result);
  EXPECT_THAT(text, HasSubstr("\n  5 more, see contacts in summary.json\n"));
  std::istringstream lines(text);
  std::size_t widest = 0;
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, text_width(line));
  EXPECT_LE(widest, kTextColumns) << text;
}

TEST(ContactReport, VerdictNamesTheLargestForce) {
  CaptureResult result = sample();
  const std::string sentence =
      "contacts: 2 of 3 pairs touched; largest force 12.3 N between palm and debris at t = 2.5 s";
  EXPECT_EQ(contact_sentence(result), sentence);
  EXPECT_THAT(result_table(result), HasSubstr("\n" + sentence + "\n"));
  // Contact alone is neither good nor bad.
  Answer answer = answers_of(result)[3];
  EXPECT_EQ(answer.word, "Not evaluated");
  EXPECT_EQ(answer.tone, Tone::none);
  ASSERT_EQ(answer.remarks.size(), 1U);
  EXPECT_EQ(answer.remarks[0].tone, Tone::none);
  EXPECT_EQ(answer.remarks[0].text,
            "Contacts: 2 of 3 pairs touched; largest force 12.3 N between palm and debris at t = 2.5 s.");
  result.contacts[1].beyond_model = true;
  answer = answers_of(result)[3];
  EXPECT_EQ(answer.word, "Contact too deep");
  EXPECT_EQ(answer.tone, Tone::warn);
  EXPECT_THAT(answer.sentence, HasSubstr("; TOO DEEP for the contact model: palm and debris."));
  EXPECT_THAT(answer.remarks, IsEmpty());
  result.contacts[2].beyond_model = true;
  EXPECT_THAT(contact_sentence(result), HasSubstr("palm and debris (1 more)"));
  // The first pair that left the model, with time and depths.
  result.contacts[1].beyond_model_since = 2.25, result.contacts[1].beyond_model_depth = 0.05;
  result.contacts[1].largest_depth = 0.11;
  result.contacts[2].beyond_model_since = 2.5, result.contacts[2].beyond_model_depth = 0.04;
  const std::string first = "palm and debris from t = 2.25 s on (depth 0.05 m there, at most 0.11 m)";
  EXPECT_THAT(contact_sentence(result), HasSubstr("TOO DEEP for the contact model: " + first + " (1 more)"));
  EXPECT_EQ(contact_warning(result), "contact too deep for the model: " + first +
                                         "; forces and the motion are not reliable from then on; 1 more, see contacts "
                                         "in summary.json");
  EXPECT_EQ(parsed(result)["contacts"][1]["beyond_model_since"], 2.25);
  EXPECT_EQ(parsed(result)["contacts"][1]["beyond_model_depth"], 0.05);
  result.contacts.resize(1);
  EXPECT_EQ(contact_sentence(result), "contacts: 0 of 1 pairs touched");
  EXPECT_EQ(contact_sentence({}), "");
  EXPECT_EQ(contact_warning({}), "");
}

}  // namespace contact_report_test
}  // namespace grapnel
