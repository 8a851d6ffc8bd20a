// Contact paths in SIMD lanes: equal bits at every width and in any batch, agreement with doubles, whole impacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>

#include "grapnel/impact/contact_path.hpp"
#include "impact/contact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace contact_path_packs_test {

using lanes::InstructionSet;
using Problems = std::vector<ContactPathProblem>;

// Any hypothesis, restitution between 0 and 1 inclusive, friction or none; the first contact approaches. Every fourth
// problem has more rows than the bodies have degrees of freedom, so that sticking is redundant.
ContactPathProblem random_problem(int index, int contacts) {
  Random random(100 * index + contacts);
  const int rows = 3 * contacts, motions = index % 4 == 3 ? std::min(rows, 5) : rows + index % 3;
  const std::vector<double> entries = random.values(rows * motions, 1), before = random.values(motions, 1);
  const Eigen::Map<const Eigen::MatrixXd> J(entries.data(), rows, motions);
  ContactPathProblem p;
  p.W = J * J.transpose();
  p.u = J * Eigen::Map<const Eigen::VectorXd>(before.data(), motions);
  if (p.u[0] > 0) p.u = -p.u;
  p.hypothesis = kHypotheses[index % 3];
  p.rounding = 1e-16, p.max_steps = 20000;
  for (int i = 0; i < contacts; ++i) {
    const double restitution = random.chance(0.15) ? 0 : random.chance(0.15) ? 1 : random.uniform(0, 1);
    p.contacts.push_back({restitution, random.chance(0.15) ? 0 : random.uniform(0, 1), 1});
  }
  return p;
}

// The batch that contact_impact() solves: one path, and paths with other stiffness ratios and a coarser tolerance.
Problems orders(const ContactPathProblem& problem) {
  Problems all(2 * problem.contacts.size() + 1, problem);
  for (std::size_t k = 0; k + 1 < all.size(); ++k) {
    all[k + 1].tolerance = 1e-9;
    all[k + 1].contacts[k / 2].stiffness *= k % 2 == 0 ? 100 : 0.01;
  }
  return all;
}

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](double x, double y) { return same_bits(x, y); });
}
bool same_bits(const ContactPath& a, const ContactPath& b) {
  return std::equal(a.impulse.begin(), a.impulse.end(), b.impulse.begin(), b.impulse.end(),
                    [](double x, double y) { return same_bits(x, y); }) &&
         same_bits(a.compression, b.compression) && same_bits(a.compression_work, b.compression_work) &&
         same_bits(a.normal_work, b.normal_work) && same_bits(a.friction_work, b.friction_work) && a.modes == b.modes &&
         a.steps == b.steps && a.failure == b.failure;
}

// Paths solved one at a time.
std::vector<ContactPath> alone(const Problems& problems, std::optional<InstructionSet> set) {
  std::vector<ContactPath> paths;
  for (const ContactPathProblem& p : problems) paths.push_back(follow_contacts(std::span(&p, 1), set)[0]);
  return paths;
}

void expect_same(const std::vector<ContactPath>& a, const std::vector<ContactPath>& b, InstructionSet set) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(same_bits(a[i], b[i])) << lanes::name(set) << ", path " << i;
}

constexpr int kCases = 30;

TEST(ContactPathPacks, SameBitsAtEveryWidth) {
  int stepped = 0;
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Problems problems = orders(random_problem(i, 1 + i % 4));
    const std::vector<ContactPath> one = follow_contacts(problems, InstructionSet::one_lane);
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      if (set == InstructionSet::sse2) continue;  // no fused multiply-add
      expect_same(follow_contacts(problems, set), one, set);
    }
    for (const ContactPath& path : one) stepped += path.steps > 5;
  }
  EXPECT_GT(stepped, 4 * kCases);
}

TEST(ContactPathPacks, IndependentOfOtherPaths) {
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Problems problems = orders(random_problem(i, 2 + i % 2));
    for (const InstructionSet set : lanes::supported_instruction_sets())
      expect_same(follow_contacts(problems, set), alone(problems, set), set);
  }
}

// Other systems in the batch have no effect either. A free lane takes the next path, independent of the values that the
// last path left in it.
TEST(ContactPathPacks, MorePathsThanLanesAndOfVeryDifferentLengths) {
  for (const int contacts : {1, 3}) {
    Problems problems;
    for (int i = 0; i < 21; ++i) {
      problems.push_back(random_problem(i, contacts));
      if (i % 3 == 1) problems.back().tolerance = 1e-5;
      if (i % 5 == 2) problems.back().u = -problems.back().u.cwiseAbs();
      if (i % 7 == 4) problems.back().u = problems.back().u.cwiseAbs();  // separates immediately: no steps
    }
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      const std::vector<ContactPath> paths = follow_contacts(problems, set);
      expect_same(paths, alone(problems, set), set);
      int shortest = std::numeric_limits<int>::max(), longest = 0, none = 0;
      for (const ContactPath& path : paths) {
        none += path.steps == 0;
        if (path.steps == 0) continue;
        shortest = std::min(shortest, path.steps), longest = std::max(longest, path.steps);
      }
      EXPECT_GT(none, 0);
      EXPECT_GT(longest, 8 * shortest);
    }
  }
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Problems problems = orders(random_problem(i, 5));
    ASSERT_EQ(problems.size(), 11U);
    for (const InstructionSet set : lanes::supported_instruction_sets())
      expect_same(follow_contacts(problems, set), alone(problems, set), set);
  }
}

// Paths that fail by the step limit or by non-finite values do not affect paths in other lanes.
TEST(ContactPathPacks, FailedPathDoesNotAffectOthers) {
  Problems problems;
  for (int i = 0; i < 12; ++i) problems.push_back(random_problem(i, 2));
  const Problems sound = problems;
  problems[1].max_steps = 3;
  problems[6].u[4] = std::numeric_limits<double>::quiet_NaN();
  for (const InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<ContactPath> paths = follow_contacts(problems, set), before = follow_contacts(sound, set);
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (i == 1 || i == 6) {
        EXPECT_FALSE(paths[i].failure.empty());
      } else {
        EXPECT_EQ(paths[i].failure, "");
        EXPECT_TRUE(same_bits(paths[i], before[i])) << lanes::name(set) << ", path " << i;
      }
    }
    EXPECT_EQ(paths[1].failure, "contacts did not part within 3 steps of the inner time");
    EXPECT_EQ(paths[1].steps, 3);
  }
}

// If held rates and grasps remove all freedom along the tangents, the contact rebounds as without friction.
TEST(ContactPath, WithoutFreedomAlongItsTangents) {
  ContactPathProblem p;
  p.W = Eigen::MatrixXd::Zero(3, 3), p.W(0, 0) = 0.5;
  p.u = Eigen::VectorXd::Zero(3), p.u[0] = -1;
  p.rounding = 1e-16;
  p.contacts = {{0.5, 0.4, 1}};
  const ContactPath path = follow_contacts(p);
  EXPECT_EQ(path.failure, "");
  EXPECT_NEAR(path.impulse[0], 1.5 / 0.5, 1e-10);
  EXPECT_NEAR(path.impulse.tail(2).norm(), 0, 1e-10);
}

TEST(ContactPathPacks, MatchDoubles) {
  Worst worst("packs against doubles, over the impulse"), usual("all but the worst tenth");
  std::vector<double> off;
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ContactPathProblem problem = random_problem(i, 1 + i % 4);
    const ContactPath doubles = follow_contacts(std::span(&problem, 1), std::nullopt)[0];
    ASSERT_EQ(doubles.failure, "");
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      const ContactPath packs = follow_contacts(std::span(&problem, 1), set)[0];
      ASSERT_EQ(packs.failure, "");
      // The tangential impulses of redundant contacts are not unique: compare their effect on the motion.
      const Eigen::VectorXd felt = problem.W * doubles.impulse, other = problem.W * packs.impulse;
      EXPECT_GT(felt.norm(), 0);
      off.push_back(worst.note((felt - other).norm() / felt.norm(), i));
    }
  }
  std::sort(off.begin(), off.end());
  usual.note(off[off.size() * 9 / 10], 0);
  // A path that passes close to a change of friction mode is less accurate than the tolerance.
  EXPECT_LT(worst.value(), 1e-6);   // measured 2.4e-12
  EXPECT_LT(usual.value(), 1e-10);  // measured 1.7e-14
}

TEST(ContactPathPacks, RejectDifferentNumbersOfContacts) {
  const Problems problems{random_problem(0, 2), random_problem(0, 1)};
  EXPECT_THROW(follow_contacts(problems), std::invalid_argument);
  EXPECT_TRUE(follow_contacts(Problems{}).empty());
}

// --- Whole impacts ---

ImpactSolution solution_with(InstructionSet set, const ContactCase& c, RestitutionHypothesis hypothesis) {
  const char* const before = std::getenv("GRAPNEL_LANES");
  const std::string previous = before != nullptr ? before : "";
  setenv("GRAPNEL_LANES", std::string(lanes::name(set)).c_str(), 1);
  ImpactSolution solution = c.solve(hypothesis);
  before != nullptr ? setenv("GRAPNEL_LANES", previous.c_str(), 1) : unsetenv("GRAPNEL_LANES");
  return solution;
}

TEST(ContactPathPacks, WholeImpactsHaveTheSameBitsAtEveryWidth) {
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ContactCase c = random_contacts(i, 1 + i % 3);
    const ImpactSolution one = solution_with(InstructionSet::one_lane, c, kHypotheses[i % 3]);
    EXPECT_GT(one.steps, 0);
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      if (set == InstructionSet::sse2) continue;
      const ImpactSolution other = solution_with(set, c, kHypotheses[i % 3]);
      EXPECT_TRUE(same_bits(other.velocity, one.velocity)) << lanes::name(set);
      for (std::size_t k = 0; k < one.points.size(); ++k)
        EXPECT_TRUE(same_bits(other.points[k].spread, one.points[k].spread)) << lanes::name(set);
      EXPECT_EQ(other.steps, one.steps);
    }
  }
}

}  // namespace contact_path_packs_test
}  // namespace grapnel::testing
