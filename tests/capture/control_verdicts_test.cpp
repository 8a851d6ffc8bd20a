/// Verdicts on control: saturation, stability and rest, for signals with known verdicts and for captures.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/capture/stability_monitor.hpp"
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/verdicts.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace control_verdicts_test {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// ---- Signals ----

struct Point {
  double value = 0;
  bool saturated = false;
  double energy = 1;
};

// 100 s of a signal in steps of varying length, as from an integrator.
StabilityReport verdict_on(const std::function<Point(double t)>& signal, double noise = 0, bool stores_energy = false) {
  Oscillation oscillation;
  double t = 0;
  for (int k = 0; t < 100; ++k) {
    const double next = t + 0.05 * (1 + 0.5 * std::sin(0.7 * k));
    const Point at = signal(next);
    oscillation.add({.begin = t, .end = next, .value = at.value, .limit = at.saturated ? 1 : 0, .energy = at.energy});
    t = next;
  }
  return evaluate_oscillation(oscillation, noise, stores_energy);
}

double wave(double t) { return std::sin(2 * std::numbers::pi * t / 3); }  // period 3 s

TEST(Stability, OfSignals) {
  const auto verdict = [](const auto& signal, double noise = 0, bool stores = false) {
    return verdict_on(signal, noise, stores).verdict;
  };
  // Decay, with and without oscillation; rounding; the decay of a flexible mode.
  EXPECT_EQ(verdict([](double t) { return Point{std::exp(-0.1 * t)}; }), Stability::stable);
  EXPECT_EQ(verdict([](double t) { return Point{std::exp(-0.1 * t) * wave(t)}; }), Stability::stable);
  EXPECT_EQ(verdict([](double t) { return Point{1e-9 * wave(t)}; }), Stability::stable);
  EXPECT_EQ(verdict([](double t) { return Point{std::exp(-0.02 * t) * wave(t)}; }), Stability::stable);
  EXPECT_EQ(verdict([](double) { return Point{}; }), Stability::stable);
  // Growth, and a limit cycle at the actuators' limits, also after growth from a small amplitude and after a quiet
  // interval.
  EXPECT_EQ(verdict([](double t) { return Point{1e-3 * std::exp(0.05 * t) * wave(t)}; }), Stability::unstable);
  EXPECT_EQ(verdict([](double t) { return Point{wave(t), std::abs(wave(t)) > 0.5}; }), Stability::unstable);
  EXPECT_EQ(verdict([](double t) {
              return Point{std::min(1.0, 1e-3 * std::exp(0.2 * t)) * wave(t), t > 40};
            }),
            Stability::unstable);
  EXPECT_EQ(verdict([](double t) { return Point{std::exp(-0.2 * t) + 0.01 * std::exp(0.06 * t) * wave(t)}; }),
            Stability::unstable);
  // Fast growth within a few half-cycles at the end.
  EXPECT_EQ(verdict([](double t) { return Point{t < 90 ? 1e-3 * std::exp(-t) : 1e-3 * std::exp(t - 90) * wave(t)}; }),
            Stability::unstable);
  // Exponential growth without oscillation; not that of a rate under a constant torque or a ramp of torque.
  EXPECT_EQ(verdict([](double t) { return Point{1e-4 * std::exp(0.06 * t)}; }), Stability::unstable);
  EXPECT_EQ(verdict([](double t) { return Point{1e-4 * t}; }), Stability::not_evaluated);
  EXPECT_EQ(verdict([](double t) { return Point{1e-6 * t * t}; }), Stability::not_evaluated);
  EXPECT_EQ(verdict([](double t) { return Point{1e-8 * t * t * t}; }), Stability::not_evaluated);
  // Neither: an undamped mode, a forced oscillation, a steady rate.
  EXPECT_EQ(verdict([](double t) { return Point{wave(t)}; }), Stability::not_evaluated);
  EXPECT_EQ(verdict([](double) { return Point{1}; }), Stability::not_evaluated);
  EXPECT_EQ(verdict([](double t) { return Point{wave(t) + 0.3}; }), Stability::not_evaluated);
  // A saturated brake without oscillation.
  EXPECT_EQ(verdict([](double t) { return Point{std::max(0.0, 1 - 0.01 * t), t < 95}; }), Stability::stable);
  // Energy returned by springs: the beat grows, the total energy does not.
  const auto beat = [](double t) { return Point{std::sin(0.012 * t) * wave(t), false, 1}; };
  EXPECT_EQ(verdict(beat, 0, true), Stability::not_evaluated);
  const auto fed = [](double t) { return Point{std::sin(0.012 * t) * wave(t), false, 1 + 0.1 * t}; };
  EXPECT_EQ(verdict(fed, 0, true), Stability::unstable);
  // Sensor noise at the limit.
  EXPECT_EQ(verdict([](double t) { return Point{1e-3 * wave(t), true}; }, 1e-3), Stability::stable);
}

// Errors of joints that follow a reference grow and decay with the reference.
TEST(Stability, OfForcedOscillations) {
  const auto forced = [](const std::function<double(double)>& signal) {
    Oscillation oscillation;
    for (int k = 0; k < 2000; ++k)
      oscillation.add({0.05 * k, 0.05 * (k + 1), signal(0.05 * (k + 1)), k > 500 ? 1 : 0, 1});
    return evaluate_oscillation(oscillation, 0, false, true).verdict;
  };
  EXPECT_EQ(forced([](double t) { return std::sin(0.025 * t) * wave(t); }), Stability::not_evaluated);
  EXPECT_EQ(forced([](double t) { return wave(t); }), Stability::not_evaluated);
  EXPECT_EQ(forced([](double t) { return std::exp(-0.1 * t) * wave(t); }), Stability::not_evaluated);
  EXPECT_EQ(forced([](double t) { return std::exp(0.1 * t) * wave(t); }), Stability::unstable);
}

// A limit cycle beside a reference: the actuator alternates between its limits, and the reference does not.
TEST(Stability, OfForcedLimitCycles) {
  const auto verdict = [](const std::function<int(double)>& limit, double period_of_excitation, double decay = 0) {
    Oscillation oscillation;
    double before = 1;
    for (int k = 0; k < 2000; ++k) {
      const double t = 0.05 * (k + 1);
      const double excitation = std::cos(2 * std::numbers::pi * t / period_of_excitation);
      oscillation.add({t - 0.05, t, std::exp(-decay * t) * wave(t), limit(wave(t)), 1, excitation * before < 0});
      before = excitation;
    }
    return evaluate_oscillation(oscillation, 0, false, true);
  };
  const auto both = [](double x) { return x > 0.3 ? -1 : x < -0.3 ? 1 : 0; };
  const auto one = [](double x) { return x > 0.3 ? -1 : 0; };
  const StabilityReport cycle = verdict(both, 100);
  EXPECT_EQ(cycle.verdict, Stability::unstable);
  EXPECT_THAT(cycle.reason, HasSubstr("alternates between its limits"));
  EXPECT_LT(cycle.since, 1);
  EXPECT_EQ(verdict(one, 100).verdict, Stability::not_evaluated);
  // The reference reverses as often as the limit.
  EXPECT_EQ(verdict(both, 3).verdict, Stability::not_evaluated);
  // A response that decays.
  EXPECT_EQ(verdict(both, 100, 0.02).verdict, Stability::not_evaluated);
}

TEST(Stability, ReportsThePeriodAndThePeaks) {
  const StabilityReport r = verdict_on([](double t) { return Point{2 * wave(t), std::abs(wave(t)) > 0.5}; });
  EXPECT_NEAR(r.period, 3, 0.02);            // measured 3.0
  EXPECT_NEAR(r.amplitude_before, 2, 0.02);  // measured 2.0
  EXPECT_NEAR(r.amplitude_after, 2, 0.02);   // measured 2.0
  EXPECT_NEAR(r.saturated_share, 2.0 / 3, 0.02);
}

TEST(Stability, MemoryBoundedForManyCycles) {
  Oscillation fast;
  for (int k = 0; k < 200'000; ++k) fast.add({0.01 * k, 0.01 * (k + 1), k % 2 == 0 ? 1.0 : -1.0, 1, 0});
  const StabilityReport r = evaluate_oscillation(fast, 0, false);
  EXPECT_EQ(r.verdict, Stability::unstable);
  EXPECT_NEAR(r.period, 0.02, 1e-6);
}

// ---- Captures ----

// A satellite of 50 kg with a boom; attitude control acts for `duration` seconds.
class Satellite {
 public:
  std::string actuators = {}, base = "[0.02, 0.01, 0]", control = {}, base_control = {};
  double duration = 60;

  CaptureProblem problem() const {
    std::string text =
        "schema: grapnel-scenario/1\nname: satellite\nrobot:\n  base: {mass: 50, inertia: [2, 2, 3]}\n  links:\n"
        "    - {name: boom, parent: base, joint: {name: hinge, type: revolute, axis: [0, 0, 1], origin: {position: "
        "[0.3, 0, 0]}}, mass: 1, com: [0.2, 0, 0], inertia: [0.001, 0.01, 0.01]}\n" +
        actuators + "initial: {joints: {hinge: 0}, base: {angular_velocity: " + base + "}}\n";
    if (!control.empty()) text += "control: " + control + "\n";
    text += "approach: {duration: " + std::to_string(duration) + ", final_joints: {hinge: 0}" +
            (base_control.empty() ? "" : ", base_control: " + base_control) + "}\n";
    return load_scenario_text(text);
  }
  CaptureResult simulated() const {
    const CaptureResult result = simulate_capture(problem());
    EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
    return result;
  }

 private:
  static CaptureProblem load_scenario_text(const std::string& text) {
    const std::string file = ::testing::TempDir() + "control_verdicts.yaml";
    std::ofstream(file) << text;
    return load_scenario(file);
  }
};

Stability verdict_of(const CaptureResult& result) {
  return result.stability.empty() ? Stability::not_evaluated : result.stability.back().verdict;
}

TEST(StabilityOfCaptures, SampledControl) {
  Satellite satellite;
  satellite.base_control = "{kp: 0.2, kd: 1, limit: 0.5}", satellite.control = "{period: 0.1}";
  const CaptureResult stable = satellite.simulated();
  EXPECT_EQ(verdict_of(stable), Stability::stable);
  EXPECT_THAT(stable.warnings, IsEmpty());
  // Sampled too slowly for its gains: the motion grows without bound, or to a limit cycle if the torque is limited.
  satellite.control = "{period: 1, delay: 0.5}", satellite.base_control = "{kp: 4, kd: 6, limit: 0.5}";
  satellite.duration = 120;
  const CaptureResult cycle = satellite.simulated();
  EXPECT_EQ(verdict_of(cycle), Stability::unstable);
  EXPECT_THAT(cycle.warnings, Contains(HasSubstr("control is unstable in approach: the angular velocity of the base")));
  EXPECT_THAT(result_table(cycle), HasSubstr("stability: UNSTABLE"));
  satellite.base_control = "{kp: 4, kd: 6}", satellite.duration = 12;
  EXPECT_EQ(verdict_of(satellite.simulated()), Stability::unstable);
}

TEST(StabilityOfCaptures, FreeTumblingIsNotEvaluated) {
  Satellite satellite;
  satellite.base = "[0.2, 0.1, 0.3]";
  const CaptureResult free = satellite.simulated();
  EXPECT_THAT(free.stability, IsEmpty());
  EXPECT_THAT(free.saturation, IsEmpty());
  EXPECT_THAT(free.warnings, IsEmpty());
}

const SaturationReport* find(const CaptureResult& result, SaturationReport::Actuator actuator,
                             const std::string& name) {
  for (const SaturationReport& s : result.saturation) {
    if (s.actuator == actuator && s.name == name) return &s;
  }
  return nullptr;
}

// The wheels store at most 4 x 0.0005 x 419 N m s, less than the angular momentum of the base.
TEST(Saturation, OfWheels) {
  Satellite satellite;
  satellite.actuators = "  wheel_array: {configuration: pyramid, inertia: 0.0005, torque: 0.05, rate: 418.88}\n";
  satellite.base = "[0.3, -0.2, 0.3]";
  satellite.base_control = "{actuators: wheels, kp: 0.2, kd: 1}";
  const CaptureResult result = satellite.simulated();
  ASSERT_FALSE(result.saturation.empty());
  const SaturationReport& s = result.saturation.front();
  EXPECT_EQ(s.actuator, SaturationReport::Actuator::wheel);
  EXPECT_EQ(s.quantity, SaturationReport::Quantity::rate);
  EXPECT_EQ(s.limit, 418.88);
  EXPECT_TRUE(s.at_end);
  EXPECT_LE(s.first_time + s.duration, 60);  // measured 48.3: the rate leaves its limit temporarily
  EXPECT_NEAR(s.share, s.duration / 60, 1e-12);
  EXPECT_GT(s.share, 0.5);
  EXPECT_THAT(result.warnings, Contains(AllOf(HasSubstr("saturated: wheel wheel"), HasSubstr("and at the end"))));
  EXPECT_THAT(result_table(result), HasSubstr("saturated: wheel wheel"));
  // With sufficient wheel capacity no saturation is reported.
  satellite.actuators = "  wheel_array: {configuration: pyramid, inertia: 0.05, torque: 5, rate: 418.88}\n";
  const CaptureResult room = satellite.simulated();
  EXPECT_THAT(room.saturation, IsEmpty());
  EXPECT_THAT(room.warnings, IsEmpty());
}

std::string six_pairs_of_thrusters(double force) {
  std::string text = "  thrusters:\n";
  int k = 0;
  for (const int axis : {0, 1, 2}) {
    for (const int turn : {1, -1}) {
      for (const int side : {1, -1}) {
        double position[3] = {0, 0, 0}, direction[3] = {0, 0, 0};
        position[(axis + 1) % 3] = 0.5 * side, direction[(axis + 2) % 3] = turn * side;
        text += "    - {name: thruster-" + std::to_string(++k) + ", position: [" + std::to_string(position[0]) + ", " +
                std::to_string(position[1]) + ", " + std::to_string(position[2]) + "], direction: [" +
                std::to_string(direction[0]) + ", " + std::to_string(direction[1]) + ", " +
                std::to_string(direction[2]) + "], force: " + std::to_string(force) +
                ", specific_impulse: 200, min_on_time: 0.02}\n";
      }
    }
  }
  return text;
}

TEST(Saturation, OfThrusters) {
  for (const char* more : {"", ", thrusters: {modulation: schmitt}"}) {
    SCOPED_TRACE(more);
    Satellite satellite;
    satellite.actuators = six_pairs_of_thrusters(0.02);
    satellite.base = "[0.1, -0.2, 0.3]", satellite.control = "{period: 0.1}";
    satellite.base_control = std::string("{actuators: thrusters, kp: 0.2, kd: 1") + more + "}";
    const CaptureResult weak = satellite.simulated();
    ASSERT_FALSE(weak.saturation.empty());
    EXPECT_EQ(weak.saturation.front().actuator, SaturationReport::Actuator::thruster);
    EXPECT_GT(weak.saturation.front().duration, 20);
    double largest = 0;
    for (const ThrusterReport& t : weak.thrusters->each) largest = std::max(largest, t.duty);
    EXPECT_GT(largest, 0.5);
    EXPECT_LE(largest, 1);
    EXPECT_THAT(weak.warnings, Contains(HasSubstr("on continuously, delivers less than commanded")));
  }
  // Strong thrusters fire in short pulses.
  Satellite strong;
  strong.actuators = six_pairs_of_thrusters(5), strong.control = "{period: 0.1}";
  strong.base_control = "{actuators: thrusters, kp: 0.2, kd: 1}";
  EXPECT_THAT(strong.simulated().saturation, IsEmpty());
}

// The limit of base control applies to the command, not to a rating: it saturates, and has no margin.
TEST(Saturation, BaseControlHasNoMargin) {
  Satellite satellite;
  satellite.base = "[0.1, -0.2, 0.3]", satellite.base_control = "{kp: 0.2, kd: 1, limit: 0.05}";
  const CaptureResult result = satellite.simulated();
  const SaturationReport* z = find(result, SaturationReport::Actuator::base_control, "z");
  ASSERT_TRUE(z);
  EXPECT_EQ(z->limit, 0.05);
  EXPECT_EQ(z->first_time, 0);
  EXPECT_GT(z->duration, 10);
  for (const PeakLoad& load : result.peak_loads) {
    if (load.of == "base control") {
      EXPECT_EQ(load.rating, std::numeric_limits<double>::infinity()) << load.quantity;
    }
  }
  EXPECT_EQ(worst_margin(result), nullptr);
}

// Rest after an impact: reached within the phase, or not.
TEST(Rest, OfTheMotionAfterwards) {
  SKIP_UNDER_SANITIZERS();
  const std::string file = GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml";
  const auto simulated = [&](const char* rate) {
    CaptureResult result =
        simulate_capture(load_scenario(file, std::vector<Override>{{"post_impact.at_rest.angular_velocity", rate}}));
    EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
    EXPECT_TRUE(result.rest.has_value());
    return result;
  };
  const CaptureResult loose = simulated("0.01");
  EXPECT_TRUE(loose.rest->at_rest);
  EXPECT_GT(loose.rest->time, loose.impact()->time);
  EXPECT_LT(loose.rest->time, loose.post_impact_end->time);
  EXPECT_DOUBLE_EQ(loose.rest->angular_velocity, norm(loose.post_impact_end->base.angular_velocity));
  EXPECT_THAT(result_table(loose), HasSubstr("at rest: yes, from t = "));
  EXPECT_EQ(verdict_of(loose), Stability::stable);  // of the motion after the impact; the approach is a forced motion
  const CaptureResult strict = simulated("1e-12");
  EXPECT_FALSE(strict.rest->at_rest);
  EXPECT_TRUE(std::isnan(strict.rest->time));
  EXPECT_THAT(strict.warnings, Contains(HasSubstr("at rest: NO; at the end base at ")));
}

// ---- Contacts between shapes ----

// A base at rest under attitude control, which two pads that meet a target shake: no instability.
TEST(Stability, AContactExcitesVibrationsOfAStableLoop) {
  const test::TemporaryFolder folder;
  const std::string box = "size: [0.25, 0.25, 0.25]}}\n", move = "duration: 2.5}\n";
  const std::string text =
      test::edited(test::bytes_of(GRAPNEL_SOURCE_DIR "/scenarios/parallel-gripper.yaml"),
                   {{box, box + "  wheels:\n"
                                "    - {name: x, axis: [1, 0, 0], inertia: 1e-3, torque: 0.02, rate: 600}\n"
                                "    - {name: y, axis: [0, 1, 0], inertia: 1e-3, torque: 0.02, rate: 600}\n"
                                "    - {name: z, axis: [0, 0, 1], inertia: 1e-3, torque: 0.02, rate: 600}\n"},
                    {move, move + "  base_control: {actuators: wheels, kp: 0.02, kd: 0.1}\n"}});
  const CaptureResult r = simulate_capture(load_scenario(folder.write("wheels.yaml", text)));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  ASSERT_EQ(r.stability.size(), 1U);
  EXPECT_NE(r.stability[0].verdict, Stability::unstable) << r.stability[0].reason;
  EXPECT_THAT(r.warnings, Not(Contains(HasSubstr("unstable"))));
}

}  // namespace control_verdicts_test
}  // namespace grapnel
