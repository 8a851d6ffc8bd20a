/// Sampled control computed by every case at its ticks, with motion in lanes: noisy sensors, laws with another model,
/// controllers, and thrusters; against scalar integration.

#include <gtest/gtest.h>

#include <cmath>

#include "lanes/lane_phases.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace ticks_test {

// Reads all joint rates and positions with noise and a bias; the bias changes at every second sample.
class NoisySensors final : public SensorReader {
 public:
  NoisySensors(std::uint64_t seed, bool forces) : seed_(seed), forces_(forces) {}
  bool needs_forces() const override { return forces_; }
  void read(const PhaseSample& sample, State& seen) override {
    if (ticks_++ % 2 == 0) {
      held_ = sample.state.v;
      for (std::size_t i = 0; i < held_.size(); ++i)
        held_[i] += 1e-2 * normal_number(seed_, 0, std::uint32_t(i), taken_);
      // The reading of a force sensor depends on the loads up to now.
      if (forces_) held_.back() += 1e-3 * sample.dynamics->acceleration().back();
      ++taken_;
    }
    seen.v = held_;
    const Model& model = sample.dynamics->model();
    for (int body : model.joints()) seen.q[model.bodies()[static_cast<std::size_t>(body)].q] += 1e-3;
  }
  const SensorReadings& readings() const override { return readings_; }

 private:
  std::uint64_t seed_, taken_ = 0;
  bool forces_;
  long ticks_ = 0;
  std::vector<double> held_;
  SensorReadings readings_;
};

// PID control of the joints and of the base's attitude, with internal state.
class OwnPid final : public Controller {
 public:
  explicit OwnPid(double until = std::numeric_limits<double>::infinity()) : until_(until) {}
  void update(const ControlInput& in, ControlCommand& out) override {
    if (in.time > until_) throw ControllerError("it has had enough");
    sums_.resize(in.reference.size());
    for (std::size_t j = 0; j < sums_.size(); ++j) {
      const double off = in.reference[j].position - in.sensed[j].position;
      sums_[j] += off;
      out.effort[j] = 2 * off + 0.02 * sums_[j] - 0.6 * in.sensed[j].rate;
    }
    for (int k = 0; k < 3; ++k) out.base_torque[k] = -3 * in.state.v[static_cast<std::size_t>(k)];
  }

 private:
  double until_;
  std::vector<double> sums_;
};

std::vector<Thruster> thrusters(double rise) {
  std::vector<Thruster> all;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      for (const double sense : {1.0, -1.0}) {
        Thruster t;
        t.position = Vector3d::zero(), t.direction = Vector3d::zero();
        t.position[axis] = 0.6 * side, t.direction[(axis + 1) % 3] = sense;
        t.misalignment = {0.01 * side, -0.02, 0.01 * sense};
        t.force = 1.5, t.specific_impulse = 220, t.min_on_time = 0.008, t.rise = rise, t.fall = 0.5 * rise;
        all.push_back(t);
      }
    }
  }
  return all;
}

// Lanes and scalar cases execute the same code at a tick: the difference is rounding error, measured at most 2e-13.
constexpr double kRounding = 1e-11;

std::vector<Phase> sampled_phases(int index, int count, Kind kind, double period, double delay) {
  kind.sampled = ControlTiming{period, delay};
  return random_phases(index, count, kind);
}

int cases() { return test::repetitions(9) + 1; }

TEST(LanePhase, SampledSensorsAgree) {
  Kind kind;
  kind.friction = kind.attitude = true;
  for (const double delay : {0.0, 1.3}) {
    for (const JointControl control : {JointControl::pd, JointControl::computed_torque}) {
      kind.control = control;
      std::vector<Phase> phases = sampled_phases(40, cases(), kind, 0.04, 0.04 * delay);
      std::uint64_t seed = 7;
      for (Phase& p : phases) {
        p.renew = [seed](PhaseSetup& s) { s.sensors = std::make_shared<NoisySensors>(seed, seed % 2 == 1); };
        p.renew(p.setup);
        ++seed;
      }
      EXPECT_TRUE(lane_structure(phases[0].model, phases[0].setup, tight()).control.by_case);
      expect_alike("sampled sensors", phases, kRounding);
    }
  }
}

// Also with tracking noise and clipped efforts; prescribed joints with a base controlled by sensors.
TEST(LanePhase, SampledSensorsAgreeUnderLimitsAndExactPaths) {
  Kind kind;
  kind.friction = kind.noise = kind.attitude = true;
  for (const JointControl control : {JointControl::pd, JointControl::prescribed}) {
    kind.control = control;
    kind.effort = 0.5;
    std::vector<Phase> phases = sampled_phases(41, cases(), kind, 0.05, 0.02);
    for (Phase& p : phases) {
      p.renew = [](PhaseSetup& s) { s.sensors = std::make_shared<NoisySensors>(3, false); };
      p.renew(p.setup);
    }
    expect_alike("sensors, limits, exact paths", phases, kRounding);
  }
}

TEST(LanePhase, SampledLawsWithAnotherModelAgree) {
  Kind kind;
  kind.control = JointControl::computed_torque;
  std::vector<Phase> phases = sampled_phases(42, cases(), kind, 0.04, 0.01);
  Random random(42);
  for (Phase& p : phases) p.setup.law_model = std::make_shared<const Model>(perturbed(p.model, random));
  expect_alike("laws with another model", phases, kRounding);
}

void control_by_own(Phase& p, double until = std::numeric_limits<double>::infinity()) {
  p.setup.attitude.reset();
  p.setup.commanded_root = 0;
  for (JointDrive& drive : p.setup.drives) drive.control = JointControl::controller;
  p.renew = [until](PhaseSetup& s) { s.controller = std::make_shared<OwnPid>(until); };
  p.renew(p.setup);
}

TEST(LanePhase, SampledControllersAgree) {
  Kind kind;
  kind.control = JointControl::pd, kind.friction = true, kind.effort = 1;
  for (const double delay : {0.0, 1.3}) {
    std::vector<Phase> phases = sampled_phases(43, cases(), kind, 0.04, 0.04 * delay);
    for (Phase& p : phases) control_by_own(p);
    expect_alike("controllers", phases, kRounding);
  }
}

void push_by_thrusters(Phase& p, ThrusterModulation::Kind kind, double rise) {
  p.setup.attitude = AttitudeControl{0, p.start_attitude(), {0.3, 0.4, 0.5}, {0.8, 0.9, 1}, {0.8, 0.8, 0.8}};
  p.setup.actuators.modulation.kind = kind;
  if (kind == ThrusterModulation::Kind::schmitt)
    p.setup.actuators.modulation.level_on = 0.3, p.setup.actuators.modulation.level_off = 0.1;
  p.renew = [rise](PhaseSetup& s) {
    s.actuators.thrusters = std::make_shared<ThrusterBank>(thrusters(rise), Vector3d{0.02, -0.01, 0.03});
  };
  p.renew(p.setup);
}

// The thrusters must have fired often, so that agreement is significant.
void expect_firings(const std::vector<Phase>& phases, long least) {
  long firings = 0;
  for (const Phase& p : phases) {
    PhaseDynamics dynamics(p.model, p.own_setup());
    EXPECT_TRUE(simulate_phase(dynamics, {p.start, p.begin, p.end}, tight()).finished);
    const ThrusterBank& bank = *dynamics.setup().actuators.thrusters;
    for (std::size_t i = 0; i < bank.size(); ++i) firings += bank.use(i).firings;
  }
  EXPECT_GT(firings, grapnel::test::kSanitized ? least / 4 : least);  // fewer cases
}

TEST(LanePhase, SampledThrustersAgree) {
  Kind kind;
  kind.control = JointControl::pd, kind.friction = true;
  for (const ThrusterModulation::Kind how :
       {ThrusterModulation::Kind::pulse_width, ThrusterModulation::Kind::schmitt}) {
    for (const double rise : {0.0, 0.015}) {
      std::vector<Phase> phases = sampled_phases(44, cases(), kind, 0.1, 0.03);
      for (Phase& p : phases) push_by_thrusters(p, how, rise);
      expect_firings(phases, 20);
      expect_alike(how == ThrusterModulation::Kind::schmitt ? "thrusters, on or off" : "thrusters, pulses", phases,
                   kRounding);
    }
  }
}

// One structure for all these features, with orbits and loads.
TEST(LanePhase, SampledBitsByCaseDependOnTheCaseAlone) {
  Kind kind;
  kind.control = JointControl::pd, kind.friction = kind.attitude = true;
  std::vector<Phase> phases = sampled_phases(45, 13, kind, 0.1, 0.03);
  std::uint64_t seed = 1;
  for (Phase& p : phases) {
    push_by_thrusters(p, ThrusterModulation::Kind::pulse_width, 0.01);
    p.renew = [seed, others = p.renew](PhaseSetup& s) {
      others(s);
      s.sensors = std::make_shared<NoisySensors>(seed, false);
    };
    p.renew(p.setup);
    ++seed;
  }
  expect_bits_of_the_case_alone(phases);
}

// A failing controller ends its case at the same time and with the same message as a scalar run, and no other case.
TEST(LanePhase, SampledControllersMayFail) {
  Kind kind;
  kind.control = JointControl::pd;
  std::vector<Phase> phases = sampled_phases(46, 10, kind, 0.05, 0.02);
  for (std::size_t i = 0; i < phases.size(); ++i)
    control_by_own(phases[i], i == 3 ? 1.7 : i == 5 ? 0.5 : std::numeric_limits<double>::infinity());
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight(1e-9));
  for (InstructionSet set : supported_instruction_sets()) {
    for (const auto& [id, o] : run(structure, phases, all_of(phases), set)) {
      EXPECT_EQ(o.finished(), id != 3 && id != 5);
      if (o.finished()) continue;
      EXPECT_EQ(o.status, LaneStatus::broken_off);
      EXPECT_NE(explanation(o).find("control failed"), std::string::npos);
      PhaseDynamics dynamics(phases[id].model, phases[id].own_setup());
      const PhaseOutcome alone =
          simulate_phase(dynamics, {phases[id].start, phases[id].begin, phases[id].end}, tight(1e-9));
      EXPECT_EQ(alone.end_time, o.time);
      try {
        ASSERT_TRUE(o.error);
        std::rethrow_exception(o.error);
      } catch (const ControllerError& error) {
        EXPECT_EQ(alone.failure, error.what());
      }
    }
  }
}

TEST(LanePhase, SampledCasesRequireAControl) {
  std::vector<Phase> phases = sampled_phases(47, 1, {}, 0.05, 0);
  control_by_own(phases[0]);
  const LaneStructure structure = lane_structure(phases[0].model, phases[0].setup, tight());
  EXPECT_THROW(run_lanes(structure, {[](LaneCase&) { return false; }, [](const LaneCase&, const LaneOutcome&) {}},
                         InstructionSet::one_lane),
               std::invalid_argument);
  PhaseSetup continuous = phases[0].setup;
  continuous.clock.reset(), continuous.channels.reset();
  EXPECT_EQ(lane_obstacle(phases[0].model, continuous, tight()), "a custom controller without a clock");
}

}  // namespace ticks_test
}  // namespace grapnel::testing
