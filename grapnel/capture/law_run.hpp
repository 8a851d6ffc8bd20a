#pragma once

/// @file
/// A law that moves all joints together after the capture: when it works, when it is over and why, and what is to be
/// reported of it.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/control/joint_law.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

class LawRun {
 public:
  /// The problem must outlive this.
  explicit LawRun(const CaptureProblem& problem);

  /// The motion after the impact begins with the base in this attitude: from now on the law may work.
  void begin_post_impact(const Rotationd& R_WB);
  /// A piece of motion begins in which what the law works on is held no more, so that it is over.
  bool ends_by_release(const CaptureSystem& system, double time);
  /// A piece of motion begins: the law, if it works in it. `system` lives until the piece ends. `law_model`: what the
  /// law takes it for; null: for what it is.
  std::optional<JointLaw> begin_piece(const CaptureSystem& system, const State& state, double time,
                                      std::shared_ptr<const Model> law_model = nullptr);
  /// Whether it works in the piece at hand.
  bool works() const { return evaluation_.has_value(); }

  /// Falls to zero where the law is over.
  double margin(const State& state);
  /// Looks into a step of the piece.
  void step(const PhaseStep& step);
  /// The piece has ended; `stopped`: before its time, with the least margin of everything else that may stop it being
  /// `other`. Whether the law is over now.
  bool end_piece(const State& state, double time, bool stopped, double other);
  /// Puts what there is to be said into the result.
  void write(CaptureResult& result) const;

 private:
  struct Margin {
    double value;
    LawEnd end;
    std::string joint;
  };
  JointLaw make_law(const CaptureSystem& system) const;
  bool is_held(const CaptureSystem& system) const;
  void report_begin(const State& state, double time);
  Margin least_margin(const State& state);
  void note(double time, const State& state, const JointLawCommand& command);
  void note_torque(const PhaseSample& sample);
  void describe(const State& state, double time);
  void end(LawEnd how, const std::string& joint);

  const CaptureProblem& problem_;
  std::string target_;  // that is detumbled
  bool may_work_ = false, over_ = false;
  Rotationd R_WD_ = Rotationd::identity();
  // The piece at hand:
  const CaptureSystem* system_ = nullptr;
  std::optional<JointLaw> law_;
  std::shared_ptr<const Model> law_model_;
  std::optional<JointLawEvaluation> evaluation_;
  Kinematics kinematics_;
  // Of all its pieces:
  std::optional<DetumblingReport> detumbling_;
  std::optional<BaseKeepingReport> base_keeping_;
};

}  // namespace grapnel
