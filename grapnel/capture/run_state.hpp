#pragma once

/// @file
/// What a run has at hand between its phases: the system as it now is and where it is, recorder and books.
/// Thread safety: one thread at a time.

#include <map>
#include <stdexcept>
#include <string>

#include "grapnel/capture/bookkeeper.hpp"
#include "grapnel/capture/capture_detail.hpp"
#include "grapnel/capture/capture_progress.hpp"
#include "grapnel/capture/captured_model.hpp"
#include "grapnel/capture/grip_schedule.hpp"
#include "grapnel/capture/impact_book.hpp"
#include "grapnel/capture/load_book.hpp"
#include "grapnel/capture/loop_book.hpp"
#include "grapnel/capture/moving_frame.hpp"
#include "grapnel/capture/phase_setups.hpp"
#include "grapnel/capture/recorder.hpp"
#include "grapnel/capture/watches.hpp"

namespace grapnel {

/// Ends a run early; becomes CaptureResult::failure.
struct RunFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct RunState {
  /// `the_problem` is as the frame sees it.
  RunState(const CaptureProblem& the_problem, const MovingFrame& the_frame, CaptureResult& the_result,
           CaptureDetail the_detail);

  /// The first piece of a phase has its plain name.
  std::string next_name(const std::string& phase);
  /// Whether loads are looked for in phases of motion.
  bool watches_loads() const { return detail != CaptureDetail::columns; }
  bool holds_by(PostImpactSetup::Joints joints) const;
  const Body& joint_body(const CaptureSystem& of, std::size_t joint) const;

  /// Between the representations: all targets free, or hanging on the arms that hold them.
  void to_free();
  void to_joined();

  const CaptureProblem& problem;
  const MovingFrame frame;  // in which all states are
  CaptureResult& result;
  const CaptureDetail detail;
  CaptureProgress progress = {};
  const CaptureSystem free;          // all targets free
  CaptureSystem system;              // as it is now
  std::optional<Recorder> recorder;  // of full detail
  Bookkeeper bookkeeper;
  Watches watches;
  LoopBook loops;
  LoadBook loads;
  ImpactBook impact_book;
  GripSchedule schedule;
  std::vector<JointTrajectory> trajectories;  // of the approach, per robot joint
  SegmentControl control;
  std::vector<HeldGrip> grips;        // that hold now, in the free system's bodies
  std::map<std::string, int> pieces;  // of phases, by name
  State state;
  double time = 0;
  double last_look = 0;    // time of the last sample or look at a phase
  bool rebounded = false;  // something has been thrown back
};

}  // namespace grapnel
