#pragma once

/// @file
/// Private to this module: one law's part of a run, what LawRun asks of it, and the laws that there are.

#include <functional>
#include <memory>
#include <string>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/impact/compliant_impact.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// A law in a run: from a problem's settings to the law of each piece of motion, and to its report.
class LawOfRun {
 public:
  /// Told of what ends a law: a margin that falls to zero there, how that is called, and whose it is.
  using Consider = std::function<void(double margin, LawEnd end, const std::string& joint)>;

  LawOfRun() = default;
  LawOfRun(const LawOfRun&) = delete;
  LawOfRun& operator=(const LawOfRun&) = delete;
  virtual ~LawOfRun() = default;

  /// The motion after the impact begins. `known`: the state with the posture as laws know it.
  virtual void begin_post_impact(const CaptureSystem& system, const State& known) {
    static_cast<void>(system), static_cast<void>(known);
  }
  /// Whether there is something to work on.
  virtual bool has_work(const CaptureSystem& system) const {
    static_cast<void>(system);
    return true;
  }
  /// A piece of motion begins, in which it works; with the first begins its report. `law_model`: what the law takes the
  /// system for, with the same bodies and joints. Both live until the piece ends. `known`: the state with the posture
  /// as the law knows it, from which it takes its references; `state`: the true one, for the report.
  virtual std::shared_ptr<JointLaw> begin_piece(const CaptureSystem& system, const Model& law_model, const State& state,
                                                const State& known, double time) = 0;
  /// What may end it beside its condition and the ranges of its joints.
  virtual void consider(const State& state, const Consider& consider) {
    static_cast<void>(state), static_cast<void>(consider);
  }
  /// At an instant of the piece, with what the law says there.
  virtual void note(const PhaseSample& sample, const JointLawCommand& command) = 0;
  /// How things are now, for the report.
  virtual void describe(const State& state, double time) = 0;
  /// It is over.
  virtual void end(LawEnd how, const std::string& joint) = 0;
  /// The time at which what it works on was let go, where that ended it.
  virtual void released_at(double time) { static_cast<void>(time); }
  virtual void write(CaptureResult& result) const = 0;
};

/// The problem must outlive what these return. Null where it has no such law.
std::unique_ptr<LawOfRun> law_of_post_impact(const CaptureProblem& problem);
std::unique_ptr<LawOfRun> law_of_approach(const CaptureProblem& problem);

/// A contact that closes.
struct MeetingContact {
  std::string end_effector, target;
  CompliantContact contact;
};
/// What contacts meet, in the system and state in which they begin.
std::vector<EffectiveMass> effective_masses(const CaptureProblem& problem, const CaptureSystem& system,
                                            const State& state, std::span<const MeetingContact> contacts);
/// The law that works during an impact in time that begins now, `masses` of its contacts; null: none. `law_model`: what
/// the law takes the system for.
std::shared_ptr<JointLaw> law_in_impact(const CaptureProblem& problem, const CaptureSystem& system,
                                        const Model& law_model, const State& state, double time,
                                        std::span<const MeetingContact> contacts,
                                        std::span<const EffectiveMass> masses);

// The laws, each in its file.
std::unique_ptr<LawOfRun> detumbling_of_run(const CaptureProblem& problem);
std::unique_ptr<LawOfRun> base_keeping_of_run(const CaptureProblem& problem);
std::unique_ptr<LawOfRun> impedance_of_run(const CaptureProblem& problem);
std::unique_ptr<LawOfRun> grasp_force_of_run(const CaptureProblem& problem);

// What reports have in common.
inline void raise_to(double& most, double& when, double value, double time) {
  if (!(value <= most)) most = value, when = time;
}
inline void lower_to(double& least, double& when, double value, double time) {
  if (!(value >= least)) least = value, when = time;
}

/// Whether a grasp of that target holds.
bool is_held(const CaptureProblem& problem, const CaptureSystem& system, const std::string& target);
/// The robot's joints between the base and what holds a target, as positions among the robot's joints.
std::vector<std::size_t> joints_that_carry(const CaptureProblem& problem, const CaptureSystem& system,
                                           const std::string& target);
/// Joints of the robot's gyros, whose motors keep their rates.
std::vector<int> steady_joints(const CaptureSystem& system);
/// The target that a setting names, or the only one that is grasped.
std::string held_target(const CaptureProblem& problem, const std::string& named);

}  // namespace grapnel
