/// The time series of contacts between shapes, and the check of their reports for numbers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture/capture_case.hpp"
#include "grapnel/capture/contact_series.hpp"
#include "grapnel/capture/finite_result.hpp"
#include "grapnel/problem/contact_pairs.hpp"

namespace grapnel::testing {
namespace contact_series_test {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;

// Series with two samples: contact of the second pair, then none.
TimeSeries recorded() {
  const ContactSeries contacts({{"finger", "debris"}, {"palm", "debris/panel"}});
  TimeSeries result;
  result.phases = {"motion"};
  result.series = contacts.series();
  std::vector<ContactSample> samples(2);
  samples[1].touches = true;
  samples[1].point = {1, 2, 3}, samples[1].force_on_b = {4, 5, 6};
  samples[1].normal_force = 7, samples[1].depth = 8;
  samples[0].depth = 9;  // of bodies that are apart, without meaning
  for (const auto& one : {std::span<const ContactSample>(samples), std::span<const ContactSample>()}) {
    SeriesRow row(result);
    contacts.put(one, row);
    result.time.push_back(static_cast<double>(result.time.size()));
    result.phase.push_back(0);
  }
  return result;
}

const Series& series_of(const TimeSeries& all, const std::string& path) {
  for (const Series& one : all.series) {
    if (one.path == path) return one;
  }
  throw std::runtime_error("no series " + path);
}

TEST(ContactSeries, EachPairHasForceDepthAndPoint) {
  const TimeSeries all = recorded();
  EXPECT_NO_THROW(check_time_series(all));
  ASSERT_EQ(all.series.size(), 8U);
  EXPECT_THAT(series_of(all, "contacts/palm--debris/panel/force").data, ElementsAre(4, 5, 6, 0, 0, 0));
  EXPECT_THAT(series_of(all, "contacts/palm--debris/panel/normal_force").data, ElementsAre(7, 0));
  EXPECT_THAT(series_of(all, "contacts/palm--debris/panel/depth").data, ElementsAre(8, 0));
  EXPECT_EQ(series_of(all, "contacts/palm--debris/panel/force").unit, "N");
  EXPECT_EQ(series_of(all, "contacts/palm--debris/panel/depth").unit, "m");
  EXPECT_THAT(series_of(all, "contacts/finger--debris/depth").data, ElementsAre(0, 0));
}

TEST(ContactSeries, HardPairsHaveTheirImpacts) {
  const ContactSeries contacts({{"finger", "debris"}, {"palm", "debris", true}});
  TimeSeries all;
  all.phases = {"motion"}, all.series = contacts.series();
  ASSERT_EQ(all.series.size(), 10U);
  std::vector<ContactSample> samples(2);
  samples[1].impacts = 3, samples[1].impact_impulse = 4.5;
  SeriesRow row(all);
  contacts.put(samples, row);
  all.time.push_back(0), all.phase.push_back(0);
  EXPECT_THAT(series_of(all, "contacts/palm--debris/impacts").data, ElementsAre(3));
  EXPECT_THAT(series_of(all, "contacts/palm--debris/impact_impulse").data, ElementsAre(4.5));
  EXPECT_THAT(series_of(all, "contacts/palm--debris/normal_force").data, ElementsAre(0));
}

TEST(ContactSeries, BodiesThatAreApartHaveNoPoint) {
  const TimeSeries all = recorded();
  const std::vector<double>& point = series_of(all, "contacts/palm--debris/panel/point").data;
  ASSERT_EQ(point.size(), 6U);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(point[k], k + 1);
    EXPECT_TRUE(std::isnan(point[3 + k])) << k;
  }
  for (const double x : series_of(all, "contacts/finger--debris/point").data) EXPECT_TRUE(std::isnan(x));
}

// ---- Pairs of a problem ----

CaptureProblem two_arms() {
  CaptureProblem p = random_capture(0);
  Geometry ball;
  ball.shape = Geometry::Shape::sphere, ball.size = {0.1, 0, 0};
  p.robot.geometry.clear();
  for (const BodyDescription& body : p.robot.bodies) p.robot.geometry.emplace_back(body.name, ball);
  for (TargetSetup& t : p.targets) t.geometry = {ball};
  p.obstacles = {{"wall", Posed::identity(), {}}};
  MaterialSetup rubber;
  rubber.name = "rubber";
  rubber.surface.stiffness = 1e4;
  p.materials = {rubber};
  return p;
}

std::vector<std::pair<std::string, std::string>> contact_pair_names(const CaptureProblem& p) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const ContactPair& pair : contact_pairs(p, make_capture_system(p)))
    names.emplace_back(contact_name(p, pair.a), contact_name(p, pair.b));
  return names;
}

TEST(ContactPairs, EachPairIsListedOnceInTheOrderOfTheProblem) {
  CaptureProblem p = two_arms();
  EXPECT_THAT(contact_pair_names(p), IsEmpty());
  const std::string base = p.robot.base, link = p.robot.bodies.back().name, target = p.targets[0].name;
  ASSERT_NE(base, link);
  ContactPairsSetup named, grouped;
  named.materials = grouped.materials = {"rubber"};
  named.pairs = {{link, BodyName::of_target(0)}, {base, BodyName::of_obstacle(0)}};
  grouped.first_group = {base, link};
  grouped.second_group = {BodyName::of_target(0), BodyName::of_obstacle(0)};
  p.contacts = {named, grouped};
  EXPECT_THAT(contact_pair_names(p),
              ElementsAre(Pair(link, target), Pair(base, "wall"), Pair(base, target), Pair(link, "wall")));
  p.contacts[1].exclude = {{BodyName::of_target(0), base}};  // in the other order
  EXPECT_THAT(contact_pair_names(p), ElementsAre(Pair(link, target), Pair(base, "wall"), Pair(link, "wall")));
}

TEST(ContactPairs, AllAreThePairsThatClearanceMonitorsAndTheObstacles) {
  CaptureProblem p = two_arms();
  p.clearance.enabled = false;
  ContactPairsSetup all;
  all.all = true;
  all.materials = {"rubber"};
  p.contacts = {all};
  const std::string base = p.robot.base, target = p.targets[0].name;
  const auto pairs = contact_pair_names(p);
  EXPECT_THAT(pairs, Contains(Pair(base, "wall")));
  EXPECT_THAT(pairs, Contains(Pair(target, "wall")));
  const auto joins = [&](const auto& pair) {
    return (pair.first == base && pair.second == target) || (pair.first == target && pair.second == base);
  };
  EXPECT_EQ(std::ranges::count_if(pairs, joins), 1);
  p.contacts[0].exclude = {{base, BodyName::of_target(0)}};
  EXPECT_EQ(std::ranges::count_if(contact_pair_names(p), joins), 0);
  EXPECT_EQ(contact_pair_names(p).size() + 1, pairs.size());
}

// ---- Numbers ----

TEST(ContactReports, NumbersThatAreNotFiniteAreNamed) {
  CaptureResult result;
  ContactPairReport apart, touching;
  apart.body_a = "finger", apart.body_b = "debris";
  apart.peak_point = {NAN, 0, 0};  // without contact it is not written
  touching.body_a = "palm", touching.body_b = "debris", touching.touches = 1, touching.first_time = 1;
  result.contacts = {apart, touching};
  EXPECT_EQ(first_not_finite(result), "");
  result.contacts[1].peak_point = {0, NAN, 0};
  EXPECT_EQ(first_not_finite(result), "contacts[palm, debris].peak_point");
  result.contacts[1].first_time = INFINITY;
  EXPECT_EQ(first_not_finite(result), "contacts[palm, debris].first_time");
  result.contacts[0].friction_loss = NAN;
  EXPECT_EQ(first_not_finite(result), "contacts[finger, debris].friction_loss");
}

}  // namespace contact_series_test
}  // namespace grapnel::testing
