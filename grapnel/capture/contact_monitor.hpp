#pragma once

/// @file
/// Observes contacts between shapes: time series, the report of each pair of bodies, and the energy check of the
/// ledger. Thread safety: one thread at a time.

#include <vector>

#include "grapnel/capture/contact_series.hpp"
#include "grapnel/capture/motion_observer.hpp"
#include "grapnel/contact/contact_peaks.hpp"
#include "grapnel/impact/compliant_shapes.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/problem/contact_pairs.hpp"

namespace grapnel {

class ContactMonitor final : public MotionObserver {
 public:
  /// `free`: the system with free targets.
  ContactMonitor(const CaptureProblem& problem, const CaptureSystem& free, const MovingFrame& frame);

  std::vector<Series> series() const override { return series_.series(); }
  void put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const override;
  void begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) override;
  bool observes() const override { return !reports_.empty(); }
  void step(const PhaseStep& step) override;
  void end_phase(double duration) override;
  void write(CaptureResult& result) const override;

  /// The contacts of the following samples between phases, per pair; empty: none touches. `contacts` outlives them.
  void set_instant(std::span<const GroupContact> contacts) { instant_ = contacts; }
  /// Adds a compliant impact that ended at `end` [s].
  void add_impact(const ImpactShapes& impact, double end);
  /// Adds an instantaneous impact, in which hard contacts took part: their histories after it, and the work that they
  /// exchanged with other contacts [J].
  void add_hard_impact(const ContactSet& contacts, double time, double exchanged);

 private:
  void search_peaks(const PhaseStep& step);
  void note_peak(ContactPairReport& report, const ContactPeak& peak, double begin) const;
  void check_energy(std::size_t group);
  void check_impacts(const ContactSet& contacts);
  void add_motion(std::size_t group, const ContactIntegrals& sum, const GroupHistory& history, double time);

  MovingFrame frame_;
  std::vector<ContactPairReport> reports_;  // integrals and histories: of completed phases
  ContactSeries series_;
  // The current phase:
  const CaptureSystem* system_ = nullptr;
  ContactSet* set_ = nullptr;
  Kinematics kinematics_;
  std::vector<ExternalWrench> wrenches_;     // scratch
  ContactPeaks peaks_;                       // of the phase
  std::vector<ContactIntegrals> integrals_;  // of the phase, per pair
  std::vector<double> stored_;               // elastic energy at the begin, per pair [J]
  double time_ = 0;                          // reached [s]
  std::span<const GroupContact> instant_;    // between phases
  // Of the whole run:
  double residual_ = 0, exchanged_ = 0;  // largest error of an energy balance, and its largest term [J]
  double with_others_ = 0;               // work that hard contacts exchanged with contacts of impact laws [J]
};

}  // namespace grapnel
