#pragma once

/// @file
/// What happens at the instants at which grips close, contacts touch, joints stop and grips let go: every jump in a
/// run's velocities. Thread safety: one thread at a time.

#include "grapnel/capture/compliant_run.hpp"
#include "grapnel/capture/run_state.hpp"

namespace grapnel {

class RunImpacts {
 public:
  explicit RunImpacts(RunState& run) : run_(run) {}

  /// Decides on grasps, and lets those that fit meet: at once, in one impact; but what grips does so before what only
  /// touches. Whether any did.
  bool close(const std::vector<std::size_t>& grasps);
  /// All joints are to do what they do after the approach.
  void settle_all();
  /// Joints that settle while no grip closes still have to stop, if they are braked.
  void stop_joints();
  /// Grips let go whose time since the approach's end, at `post_start`, has come.
  void release_due(double post_start);

 private:
  void settle(std::size_t joint);
  void settle_arm(std::size_t grasp);
  std::vector<HeldRate> driven_rates() const;
  std::vector<HeldRate> rates_in_impact() const;
  void sample_contact();
  void sample_instant(double time, const State& state, std::span<const GripSample> grips);
  void sample_yielding(const std::vector<std::size_t>& closing, const CompliantSample& sample);
  void touch(const std::vector<std::size_t>& closing);
  Momentumd momentum_about_origin(const State& state) const;
  /// Valid until the next call.
  const CaptureProblem& with_grasps(const std::vector<std::size_t>& grasps);
  void refuse_wide_gaps(const std::vector<std::size_t>& closing, const Contact& contact);
  void refuse_distant(const std::vector<std::size_t>& closing);
  Contact contact_of(const std::vector<std::size_t>& closing);
  void bear(const std::string& phase, const BrakeOutcome& brake);
  Contact meet(const std::vector<std::size_t>& closing);
  void keep(ImpactReport report);
  bool holds_after(std::size_t grasp, ImpactSetup::Law law) const;
  void hold_or_part(const std::vector<std::size_t>& closing, ImpactSetup::Law law, const ImpactReport& report,
                    std::span<const std::string> unfinished);
  void impact(const std::vector<std::size_t>& closing, ImpactSetup::Law law);
  void yield(const std::vector<std::size_t>& closing);
  int velocity_in(const CaptureSystem& system, int free_velocity) const;
  std::vector<double> brake_at_once(std::span<const HeldRate> held);
  void stiffen(const std::vector<std::size_t>& closing, CompliantRun& run);
  std::optional<BrakeReport> brake();
  ImpactOutcome solve_impact(const std::vector<std::size_t>& closing, const Contact& contact, ImpactSetup::Law law);

  RunState& run_;
  std::optional<CaptureProblem> part_;  // the problem with part_grasps_ alone
  std::vector<std::size_t> part_grasps_;
  std::string phase_;         // of the last contact
  std::size_t released_ = 0;  // of PostImpactSetup::releases
};

}  // namespace grapnel
