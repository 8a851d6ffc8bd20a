#pragma once

/// @file
/// Private to this module: the interface between CoordinatedControl and a law, and the available laws.

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "grapnel/capture/compliant_run.hpp"
#include "grapnel/control/joint_law.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// A law in a run: converts a problem's settings to the law of each motion segment, and to its report.
class CoordinatedLaw {
 public:
  /// Receives conditions that end a law: a margin that falls to zero, the kind of end, and the joint.
  using Consider = std::function<void(double margin, LawEnd end, const std::string& joint)>;

  explicit CoordinatedLaw(LawReport::Law law, bool in_approach = false) : law_(law), in_approach_(in_approach) {}
  CoordinatedLaw(const CoordinatedLaw&) = delete;
  CoordinatedLaw& operator=(const CoordinatedLaw&) = delete;
  virtual ~CoordinatedLaw() = default;

  /// Begins the motion after the impact. `known`: the state with the posture as the laws know it.
  virtual void begin_post_impact(const CaptureSystem& system, const State& known) {
    static_cast<void>(system), static_cast<void>(known);
  }
  /// Whether the law has a target to act on.
  virtual bool has_work(const CaptureSystem& system) const {
    static_cast<void>(system);
    return true;
  }
  /// Begins a motion segment with the law; its report begins with the first piece. `law_model`: the model that the law
  /// uses, with the same bodies and joints. Both live until the piece ends. `known`: the state with the posture as the
  /// law knows it, from which it takes its references; `state`: the true one, for the report.
  virtual std::shared_ptr<JointLaw> begin_segment(const CaptureSystem& system, const Model& law_model,
                                                  const State& state, const State& known, double time) = 0;
  /// Further end conditions, besides its own condition and the joint ranges.
  virtual void consider(const State& state, const Consider& consider) {
    static_cast<void>(state), static_cast<void>(consider);
  }
  /// Records an instant of the piece, with the law's command.
  virtual void note(const PhaseSample& sample, const JointLawCommand& command) = 0;
  /// Records the current state in the report.
  virtual void describe(const State& state, double time) = 0;
  /// Ends the law.
  void end(LawEnd how, const std::string& joint) { report_->ended = how, report_->joint = joint; }
  /// Records the time at which the release of its target ended the law.
  void released_at(double time) { report_->end = time; }
  /// Its report replaces that of the same law in an earlier phase. A law without a report leaves none.
  virtual void write(CaptureResult& result) const;

 protected:
  LawReport& begin_report(double time) {
    LawReport& report = report_.emplace();
    report.law = law_, report.in_approach = in_approach_, report.begin = time;
    return report;
  }
  /// Records what the limits left of a command.
  void note_command(double time, const JointLawCommand& command);

  std::optional<LawReport> report_;  // of all pieces

 private:
  LawReport::Law law_;
  bool in_approach_;
};

/// The problem must outlive the returned objects. Null if it has no such law.
std::unique_ptr<CoordinatedLaw> coordinated_law_of_post_impact(const CaptureProblem& problem);
std::unique_ptr<CoordinatedLaw> coordinated_law_of_approach(const CaptureProblem& problem);

/// The effective masses that contacts meet, in the system and state at the start of the impact.
std::vector<EffectiveMass> effective_masses(const CaptureProblem& problem, const CaptureSystem& system,
                                            const State& state, std::span<const ClosingContact> contacts);
/// All contacts of an impact, and their effective masses.
struct ClosingContacts {
  std::span<const ClosingContact> contacts;
  std::span<const EffectiveMass> masses;
};
/// The law during a compliant impact that begins now; null: none. `law_model`: the model that the law uses.
std::shared_ptr<JointLaw> law_in_impact(const CaptureProblem& problem, const CaptureSystem& system,
                                        const Model& law_model, const State& state, double time,
                                        const ClosingContacts& closing);

// The laws, each in a separate file.
std::unique_ptr<CoordinatedLaw> detumbling_of_run(const CaptureProblem& problem);
std::unique_ptr<CoordinatedLaw> base_keeping_of_run(const CaptureProblem& problem);
std::unique_ptr<CoordinatedLaw> impedance_of_run(const CaptureProblem& problem);
std::unique_ptr<CoordinatedLaw> grasp_force_of_run(const CaptureProblem& problem);

// Common functions of reports.
inline void raise_to(double& most, double& when, double value, double time) {
  if (!(value <= most)) most = value, when = time;
}
inline void lower_to(double& least, double& when, double value, double time) {
  if (!(value >= least)) least = value, when = time;
}

/// Whether a grasp of that target holds.
bool is_held(const CaptureProblem& problem, const CaptureSystem& system, const std::string& target);
/// The robot's joints between the base and the grasps of a target, as indices among the robot's joints.
std::vector<std::size_t> joints_that_carry(const CaptureProblem& problem, const CaptureSystem& system,
                                           const std::string& target);
/// Joints of the robot's gyros, whose motors hold their rates.
std::vector<int> steady_joints(const CaptureSystem& system);
/// The target that a setting names, or the only grasped one.
std::string held_target(const CaptureProblem& problem, const std::string& named);

}  // namespace grapnel
