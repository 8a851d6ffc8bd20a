#pragma once

/// @file
/// A law that moves all joints together: when it works, when it is over and why.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/capture/law_of_run.hpp"

namespace grapnel {

class LawRun {
 public:
  /// The problem must outlive this.
  explicit LawRun(const CaptureProblem& problem);

  /// The motion after the impact begins: from now on its law may work.
  void begin_post_impact(const CaptureSystem& system, const State& known);
  /// A piece of motion begins in which what the law works on is held no more, so that it is over.
  bool ends_by_release(const CaptureSystem& system, double time);
  /// A piece of motion begins: the law, if one works in it. `system` lives until the piece ends. `law_model`: what the
  /// law takes it for; null: for what it is. `known`: the state with the posture as laws know it.
  std::shared_ptr<JointLaw> begin_piece(const CaptureSystem& system, const State& state, const State& known,
                                        double time, std::shared_ptr<const Model> law_model = nullptr);
  /// The problem has another phase: its law takes the place of the one before, whose report is put into the result.
  void next_phase(CaptureResult& result);
  /// Whether the law of the phase at hand has come to its end.
  bool is_over() const { return now_ && now_->over; }
  /// Whether it works in the piece at hand.
  bool works() const { return law_ != nullptr; }

  /// Falls to zero where the law is over.
  double margin(double time, const State& state);
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
  /// A phase's law.
  struct Phase {
    std::unique_ptr<LawOfRun> part;  // null: none
    bool begun = false, over = false;
  };
  Margin least_margin(double time, const State& state);
  void end(LawEnd how, const std::string& joint);

  const CaptureProblem& problem_;
  Phase approach_, after_;
  Phase* now_ = nullptr;  // null: no law may work
  // The piece at hand:
  const CaptureSystem* system_ = nullptr;
  std::shared_ptr<const Model> law_model_;
  std::shared_ptr<JointLaw> law_;
};

}  // namespace grapnel
