// Compliant impacts in packs: identical bits at every width, the numbers of doubles, whole impacts.
#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>

#include "grapnel/impact/compliant_system.hpp"
#include "impact/compliant_case.hpp"
#include "impact/impact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace compliant_packs_test {

using lanes::InstructionSet;

// Efforts that depend on time, state and wrenches.
class Pulling : public ImpactDrive {
 public:
  explicit Pulling(const Model& model) : model_(model) {}
  double next_break(double) const override { return std::numeric_limits<double>::infinity(); }
  void begin_segment(double, const State&, std::span<const ExternalWrench>) override {}
  void efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
               std::span<double> effort) override {
    for (const int body : model_.joints()) {
      const Body& b = model_.bodies()[body];
      effort[b.v] = std::cos(50 * t) - 3 * state.v[b.v] + state.q[b.q] + 1e-3 * wrenches[0].F_W.linear[0];
    }
  }

 private:
  const Model& model_;
};

// Random robots with compliant grasps of all kinds or contacts of all laws on targets. Some joints have springs, some
// are held.
struct YieldingCase {
  Model model;
  State state;
  std::vector<CompliantContact> contacts;
  std::vector<CompliantGrasp> grasps;
  std::vector<int> held;
  bool driven;
};

Model with_springs(const Model& model) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription body = b.description;
    if (has_one_axis(body.joint.type) && b.v % 3 == 0)
      body.joint.spring = JointSpring{40, 0.3, 0.1, b.v % 2 ? 0.02 : 0};
    builder.add(body);
  }
  return builder.build();
}

YieldingCase yielding_case(int index) {
  const ImpactCase c = index % 2 == 0 ? random_impact(index) : random_open_impact(index);
  YieldingCase y{with_springs(c.model), c.state, {}, {}, {}, index % 3 == 0};
  const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
  Random random(index);
  for (std::size_t i = 0; i < c.grasps.size(); ++i) {
    Grasp g = c.grasps[i];
    if (i % 2 == 1 && index % 2 == 1) {
      const Vector3d n = random.direction();
      const auto law = static_cast<ContactForceModel>((index / 2 + static_cast<int>(i)) % 3);
      y.contacts.push_back({g.robot_body, g.target_body, g.p_WC, n, law, 1e5,
                            law == ContactForceModel::kelvin_voigt ? 1e2 : 0.4, index % 4 == 1 ? 1.5 : 2.3, 0.3, 1e-2});
      continue;
    }
    g.model = models[(index + static_cast<int>(i)) % 3];
    g.hinge_W = random.direction();
    y.grasps.push_back({g, 1e5, 2e3, 2e4, 4e2});
  }
  if (index % 5 == 2) {
    for (const int joint : y.model.joints()) {
      const Body& b = y.model.bodies()[joint];
      if (y.held.size() < 2 && !b.description.joint.spring) y.held.push_back(b.v);
    }
  }
  return y;
}

// Points near the start, and their values.
struct Points {
  std::vector<double> t, y;
};
Points points_of(const CompliantSystem& system, int count, int seed) {
  Random random(1000 + seed);
  Points points;
  for (int k = 0; k < count; ++k) points.t.push_back(random.uniform(0, 0.1));
  points.y = random.values(count * system.size(), 1e-2);
  return points;
}

struct Found {
  std::vector<double> rates;
  CompliantSystem::Sampled sampled;
};
Found found_at(const YieldingCase& c, std::optional<InstructionSet> set, int count, int first = 0, int last = -1) {
  Pulling drive(c.model);
  CompliantSystem system(c.model, c.state, c.contacts, c.grasps, c.held, c.driven ? &drive : nullptr, set);
  for (std::size_t i = 0; i < system.phase.size(); ++i)
    system.phase[i] = i % 2 == 0 ? ContactPhase::pressing : ContactPhase::relaxing;
  const Points points = points_of(system, count, 0);
  if (last < 0) last = count;
  const auto n = static_cast<std::size_t>(last - first), size = static_cast<std::size_t>(system.size());
  const std::span<const double> t = std::span(points.t).subspan(first, n),
                                y = std::span(points.y).subspan(first * size, n * size);
  Found found;
  found.rates.resize(y.size());
  std::vector<InterfaceLoad> loads(n * static_cast<std::size_t>(system.interfaces()));
  system.rates(t, y, found.rates, loads);
  system.sample(t, y, found.sampled);
  // rates() and sample() give equal loads at the interfaces.
  EXPECT_EQ(std::memcmp(loads.data(), found.sampled.loads.data(), loads.size() * sizeof(InterfaceLoad)), 0);
  return found;
}

std::span<const double> numbers(const std::vector<InterfaceLoad>& loads) {
  return {reinterpret_cast<const double*>(loads.data()), loads.size() * sizeof(InterfaceLoad) / sizeof(double)};
}

std::vector<std::span<const double>> all_of(const Found& f) {
  return {f.rates, f.sampled.q, f.sampled.v, f.sampled.acceleration, numbers(f.sampled.loads)};
}

bool same_bits(std::span<const double> a, std::span<const double> b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) {
           return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
         });
}
bool same_bits(const Found& a, const Found& b) {
  const auto x = all_of(a), y = all_of(b);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!same_bits(x[i], y[i])) return false;
  }
  return true;
}

// Largest difference, relative to the largest magnitude of each kind of value.
double difference(const Found& a, const Found& b) {
  const auto x = all_of(a), y = all_of(b);
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    double size = 0, off = 0;
    EXPECT_EQ(x[i].size(), y[i].size());
    for (std::size_t k = 0; k < x[i].size(); ++k) {
      EXPECT_TRUE(std::isfinite(x[i][k]));
      size = std::max(size, std::abs(x[i][k])), off = std::max(off, std::abs(x[i][k] - y[i][k]));
    }
    EXPECT_GT(size, 0);
    worst = std::max(worst, off / size);
  }
  return worst;
}

constexpr int kCases = 24, kPoints = 13;

TEST(CompliantPacks, SameBitsAtEveryWidth) {
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const YieldingCase c = yielding_case(i);
    const Found one = found_at(c, InstructionSet::one_lane, kPoints);
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      if (set == InstructionSet::sse2) continue;  // no fused multiply-add
      EXPECT_TRUE(same_bits(found_at(c, set, kPoints), one)) << lanes::name(set);
    }
  }
}

TEST(CompliantPacks, IndependentOfOtherPoints) {
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const YieldingCase c = yielding_case(i);
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      const Found all = found_at(c, set, kPoints), some = found_at(c, set, kPoints, 4, 11);
      const std::size_t size = all.rates.size() / kPoints;
      EXPECT_TRUE(same_bits(std::span(all.rates).subspan(4 * size, 7 * size), some.rates)) << lanes::name(set);
    }
  }
}

TEST(CompliantPacks, MatchDoubles) {
  Worst worst("packs against doubles, over the largest number");
  for (int i = 0; i < kCases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const YieldingCase c = yielding_case(i);
    const Found doubles = found_at(c, std::nullopt, kPoints);
    for (const InstructionSet set : lanes::supported_instruction_sets())
      worst.note(difference(found_at(c, set, kPoints), doubles), i);
  }
  EXPECT_LT(worst.value(), 1e-12);  // measured 1.1e-14
}

// --- Whole impacts ---

class Lanes {
 public:
  explicit Lanes(std::string_view name) {
    if (const char* before = std::getenv("GRAPNEL_LANES")) before_ = before;
    setenv("GRAPNEL_LANES", std::string(name).c_str(), 1);
  }
  Lanes(const Lanes&) = delete;
  Lanes& operator=(const Lanes&) = delete;
  ~Lanes() { before_ ? setenv("GRAPNEL_LANES", before_->c_str(), 1) : unsetenv("GRAPNEL_LANES"); }

 private:
  std::optional<std::string> before_;
};

ImpactSolution outcome_with(std::string_view lanes, const YieldingCase& c) {
  const Lanes now(lanes);
  Pulling drive(c.model);
  return compliant_impact(c.model, c.state, c.contacts, c.grasps, {.longest = 0.02, .samples = 50}, c.held, {},
                          c.driven ? &drive : nullptr);
}

std::vector<double> numbers(const ImpactSolution& o) {
  std::vector<double> all{o.duration, o.energy_residual, o.held_work, o.drive_work, o.spring_energy_lost};
  const auto add = [&](std::span<const double> x) { all.insert(all.end(), x.begin(), x.end()); };
  add(o.after.q), add(o.after.v), add(o.times), add(o.held_impulses);
  for (const std::vector<double>& a : o.accelerations) add(a);
  for (const State& s : o.states) add(s.v);
  for (const ForceHistory& h : o.forces) {
    add(h.deformation), add(h.impulse.linear.e), add(h.impulse.angular.e);
    add(std::vector{h.peak_force, h.peak_force_time, h.peak_moment, h.largest_deformation, h.energy_lost});
    for (const Vector3d& f : h.force) add(f.e);
  }
  return all;
}

TEST(CompliantPacks, WholeImpactsHaveTheSameBitsAtEveryWidth) {
  Worst velocity("velocities after, against doubles, over the largest change"), energy("energy residual");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    const YieldingCase c = yielding_case(i);
    const ImpactSolution one = outcome_with("one_lane", c);
    ASSERT_NE(one.status, ImpactSolution::Status::failed) << one.message;
    EXPECT_GT(one.steps, 5);
    const ImpactSolution doubles = outcome_with("off", c);
    for (const InstructionSet set : lanes::supported_instruction_sets()) {
      const ImpactSolution o = outcome_with(lanes::name(set), c);
      energy.note(o.energy_residual, i);
      if (set != InstructionSet::sse2) {
        EXPECT_TRUE(same_bits(numbers(o), numbers(one))) << lanes::name(set);
      }
      double off = 0, change = 0;
      for (std::size_t v = 0; v < c.state.v.size(); ++v) {
        off = std::max(off, std::abs(o.after.v[v] - doubles.after.v[v]));
        change = std::max(change, std::abs(doubles.after.v[v] - c.state.v[v]));
      }
      velocity.note(off / change, i);
    }
  }
  EXPECT_LT(velocity.value(), 1e-11);  // measured 6.2e-15
  EXPECT_LT(energy.value(), 1e-9);     // measured 7.7e-12
}

// Only the evaluation in doubles projects modal joints.
TEST(CompliantPacks, ModesUseDoubles) {
  const YieldingCase c = yielding_case(0);
  const InstructionSet set = InstructionSet::one_lane;
  EXPECT_TRUE(CompliantSystem(c.model, c.state, c.contacts, c.grasps, c.held, nullptr, set).in_packs());
  ModelBuilder builder;
  builder.add(free_body("base", 10, Symmetric3d::diagonal(1, 1, 1)));
  for (const char* name : {"first", "second"}) {
    BodyDescription segment = free_body(name, 1, Symmetric3d::diagonal(0.1, 0.1, 0.1));
    segment.parent = std::string(name) == "first" ? "base" : "first";
    segment.joint.type = JointType::revolute;
    segment.joint.axis = {0, 0, 1};
    segment.X_PF.p = {0.5, 0, 0};
    segment.joint.spring = JointSpring{100, 1, 0, 0};
    segment.joint.modal = ModalJoint{"bending", {1}};
    builder.add(segment);
  }
  builder.add(free_body("target", 5, Symmetric3d::diagonal(0.5, 0.5, 0.5)));
  const Model model = builder.build();
  State state = zero_state(model);
  set_root_twist(model, model.body_index("target"), {{0.1, 0, 0}, {-0.1, 0.05, 0}}, state);
  const CompliantGrasp grasp{
      {model.body_index("second"), model.body_index("target"), GraspModel::rigid, {1, 0, 0}, {}}, 1e4, 1e2, 1e3, 10};
  EXPECT_FALSE(CompliantSystem(model, state, {}, {&grasp, 1}, {}, nullptr, set).in_packs());
  const ImpactSolution o = compliant_impact(model, state, {}, {&grasp, 1}, {});
  EXPECT_NE(o.status, ImpactSolution::Status::failed) << o.message;
  EXPECT_LT(o.energy_residual, 1e-10);
}

}  // namespace compliant_packs_test
}  // namespace grapnel::testing
