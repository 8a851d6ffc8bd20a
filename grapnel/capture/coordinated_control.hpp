#pragma once

/// @file
/// A law that moves all joints together: when it acts, when it ends and why.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/capture/coordinated_law.hpp"

namespace grapnel {

class CoordinatedControl {
 public:
  /// The problem must outlive this.
  explicit CoordinatedControl(const CaptureProblem& problem);

  /// Begins the motion after the impact, in which the law may act.
  void begin_post_impact(const CaptureSystem& system, const State& known);
  /// Begins a motion segment; returns whether the law ends because its target is not held any more.
  bool ends_by_release(const CaptureSystem& system, double time);
  /// Begins a motion segment. Returns the law if one acts in it. `system` lives until the piece ends. `law_model`: the
  /// model that the law uses; null: the true one. `known`: the state with the posture as the laws know it.
  std::shared_ptr<JointLaw> begin_piece(const CaptureSystem& system, const State& state, const State& known,
                                        double time, std::shared_ptr<const Model> law_model = nullptr);
  /// The next phase of the problem begins: its law replaces the previous one, whose report is added to the result.
  void next_phase(CaptureResult& result);
  /// Whether the law of the current phase has ended.
  bool is_over() const { return now_ && now_->over; }
  /// Whether it acts in the current piece.
  bool works() const { return law_ != nullptr; }

  /// Falls to zero at the end of the law.
  double margin(double time, const State& state);
  /// Evaluates a step of the piece.
  void step(const PhaseStep& step);
  /// Ends the piece; `stopped`: before its time, with `other` the minimum margin of all other stop conditions. Returns
  /// whether the law has ended.
  bool end_piece(const State& state, double time, bool stopped, double other);
  /// Writes reports and warnings to the result.
  void write(CaptureResult& result) const;

 private:
  struct Margin {
    double value;
    LawEnd end;
    std::string joint;
  };
  /// A phase's law.
  struct Phase {
    std::unique_ptr<CoordinatedLaw> part;  // null: none
    bool begun = false, over = false;
  };
  Margin least_margin(double time, const State& state);
  void end(LawEnd how, const std::string& joint);

  const CaptureProblem& problem_;
  Phase approach_, after_;
  Phase* now_ = nullptr;  // null: no law may work
  // The current piece:
  const CaptureSystem* system_ = nullptr;
  std::shared_ptr<const Model> law_model_;
  std::shared_ptr<JointLaw> law_;
};

}  // namespace grapnel
