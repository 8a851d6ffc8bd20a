/// Nodes of a segment in SIMD lanes: identical bits on every instruction set, equal to those of the equations in
/// doubles.

#include <gtest/gtest.h>

#include <cstring>

#include "grapnel/plan/path_segment.hpp"
#include "plan/plan_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace segment_nodes_test {

constexpr int kSimulations = 40;

// Random robots, some with prismatic joints and rotors; floating with and without angular momentum,
// attitude-controlled, and on a fixed root; with and without splines.
struct Flight {
  Servicer servicer;
  SegmentStart start;
  std::vector<double> position, rate, coefficients;
  FreeMotion motion;
  bool floats, keeps_attitude;
  int panels;

  FloatingBase base() const {
    FloatingBase result(servicer.model, floats);
    if (keeps_attitude) result.keep_attitude();
    return result;
  }
};

Flight random_flight(int i) {
  const bool floats = i % 5 != 4;
  Flight f{random_servicer(i, floats), {}, {}, {}, {}, {}, floats, i % 5 == 3, 1 + i % 3};
  Random random(4000 + i);
  const int knots = i % 4 < 2 ? 0 : 2;
  f.start = {1.0, 4.0, JointProfile::quintic, f.servicer.theta(), f.servicer.rates(), f.servicer.X_WB(), knots};
  for (double x : f.start.position) {
    f.position.push_back(x + random.uniform(-1, 1));
    f.rate.push_back(random.uniform(-0.4, 0.4));
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(knots) * f.position.size(); ++k)
    f.coefficients.push_back(random.uniform(-1, 1));
  f.motion = free_motion(f.servicer.model, f.servicer.state, f.start.begin, random.vector(0.1));
  if (i % 5 == 1) f.motion.h.angular = Vector3d::zero();
  return f;
}

void put(std::vector<double>& all, const double* numbers, std::ptrdiff_t count) {
  all.insert(all.end(), numbers, numbers + count);
}
template <class T>
void put(std::vector<double>& all, const std::vector<T>& values) {
  put(all, reinterpret_cast<const double*>(values.data()),
      static_cast<std::ptrdiff_t>(values.size() * sizeof(T) / sizeof(double)));
}
template <class M>
void put_matrix(std::vector<double>& all, const M& m) {
  put(all, m.data(), m.size());
}

void put(std::vector<double>& all, const PlacedLinks& links) {
  put(all, links.X_BL), put(all, links.axis), put(all, links.composite), put(all, links.inertia);
  put(all, links.joint_momentum), put(all, links.k);
  put(all, &links.com[0], 3), put(all, &links.mass, 1), put(all, &links.H_inverse.xx, 6);
}

// All results of an integration, including those of every node.
std::vector<double> all_of(const Flight& f, std::optional<lanes::InstructionSet> set) {
  FloatingBase base = f.base();
  PathSegment segment(base, f.start, f.motion, set);
  segment.solve_with_path_constraints(f.panels);
  const SegmentEnd end = segment.fly(f.position, f.rate, true, SegmentAccuracy::full, f.coefficients);
  EXPECT_TRUE(end.finished) << end.failure;
  std::vector<double> all;
  put(all, &end.X_WB.R.m[0][0], 9), put(all, &end.X_WB.p[0], 3);
  put_matrix(all, end.per_position), put_matrix(all, end.per_rate), put_matrix(all, end.per_coefficient);
  for (int node = 0; node < segment.path_points(); ++node) {
    const PathSegment::SegmentPoint w = segment.path_point(node);
    put(all, w.position), put(all, w.rate), put(all, w.acceleration);
    put(all, &w.X_WB.R.m[0][0], 9), put(all, &w.X_WB.p[0], 3), put(all, &w.w_B[0], 3);
    put(all, w.links());
    put_matrix(all, segment.turn_per_unknown(node)), put_matrix(all, segment.w_per_unknown(node));
  }
  return all;
}

// Empty if they are equal.
std::string differences(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return "different sizes";
  if (std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0) return "";
  std::string result = "of " + std::to_string(a.size()) + " numbers";
  int said = 0;
  for (std::size_t i = 0; i < a.size() && said < 3; ++i) {
    if (std::memcmp(&a[i], &b[i], sizeof(double)) == 0) continue;
    result += ", " + std::to_string(i) + ": " + std::to_string(a[i]) + " - " + std::to_string(a[i] - b[i]);
    ++said;
  }
  return result;
}

TEST(SegmentNodes, HaveTheSameBitsOnEveryInstructionSet) {
  for (int i = 0; i < kSimulations; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Flight f = random_flight(i);
    const std::vector<double> expected = all_of(f, std::nullopt);
    EXPECT_GT(expected.size(), 1000u);
    for (const lanes::InstructionSet set : lanes::supported_instruction_sets()) {
      EXPECT_EQ(differences(all_of(f, set), expected), "") << lanes::name(set);
    }
  }
}

// Nodes that are not stored reuse the same memory; leftover contents must not matter.
TEST(SegmentNodes, BitsAreIndependentOfStoredNodes) {
  for (int i = 0; i < kSimulations; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Flight f = random_flight(i);
    FloatingBase base = f.base();
    PathSegment kept(base, f.start, f.motion), thrown_away(base, f.start, f.motion);
    std::vector<double> bits[2];
    for (const auto& [segment, to] : {std::pair{&kept, &bits[0]}, {&thrown_away, &bits[1]}}) {
      if (segment == &kept) segment->solve_with_path_constraints(1);
      for (const SegmentAccuracy accuracy : {SegmentAccuracy::search, SegmentAccuracy::full}) {
        const SegmentEnd end = segment->fly(f.position, f.rate, true, accuracy, f.coefficients);
        put(*to, &end.X_WB.R.m[0][0], 9), put(*to, &end.X_WB.p[0], 3);
        put_matrix(*to, end.per_position), put_matrix(*to, end.per_rate), put_matrix(*to, end.per_coefficient);
      }
    }
    EXPECT_EQ(differences(bits[0], bits[1]), "");
  }
}

// Link poses, inertias and k_j of a node equal those of FloatingBase for its joint values, bit for bit. Without angular
// momentum the base's angular velocity changes by its g_j.
TEST(SegmentNodes, AgreeWithTheFloatingBase) {
  Worst turning("base's angular velocity per unknown against FloatingBase's g_j and k_j, relative");
  int turned = 0;
  for (int i = 0; i < kSimulations; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Flight f = random_flight(i);
    FloatingBase base = f.base();
    PathSegment segment(base, f.start, f.motion);
    segment.solve_with_path_constraints(f.panels);
    ASSERT_TRUE(segment.fly(f.position, f.rate, true, SegmentAccuracy::full, f.coefficients).finished);
    const auto n = static_cast<std::size_t>(base.joints());
    for (int node = 0; node < segment.path_points(); node += 3) {
      const PathSegment::SegmentPoint w = segment.path_point(node);
      PlacedLinks placed;
      base.place(w.position, placed);
      std::vector<double> of_node, expected;
      put(of_node, w.links()), put(expected, placed);
      ASSERT_EQ(differences(of_node, expected), "") << "node " << node;
      if (!f.floats || f.keeps_attitude || norm(f.motion.h.angular) > 0) continue;
      const Vector3d u = FloatingBase::momentum_of_rates(placed, w.rate);
      EXPECT_EQ(norm(placed.H_inverse * -u - w.w_B), 0);
      std::vector<Vector3d> g(n);
      base.angular_momentum_per_angle(placed, w.rate, w.w_B, g);
      const Eigen::Matrix3Xd per_unknown = segment.w_per_unknown(node);
      for (std::size_t j = 0; j < n; ++j) {
        const Eigen::Vector3d expected_change =
            -column(placed.H_inverse * (w.a.position * g[j] + w.a.rate * placed.k[j]));
        const double difference = (per_unknown.col(static_cast<Eigen::Index>(j)) - expected_change).norm();
        EXPECT_LT(turning.note(difference / (1 + expected_change.norm()), i), 1e-14);  // measured 3e-16
        turned += expected_change.norm() > 1e-3;
      }
    }
  }
  EXPECT_GT(turned, 100);
}

}  // namespace segment_nodes_test
}  // namespace grapnel::testing
