#include "grapnel/capture/contact_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

std::vector<ContactPairReport> reports_of(const CaptureProblem& problem, const CaptureSystem& free) {
  std::vector<ContactPairReport> reports;
  for (const ContactPair& pair : contact_pairs(problem, free)) {
    ContactPairReport& report = reports.emplace_back();
    report.body_a = contact_name(problem, pair.a), report.body_b = contact_name(problem, pair.b);
    if (pair.law.hard) report.hard.emplace();
  }
  return reports;
}

std::vector<ContactSeriesPair> pairs_of_series(const std::vector<ContactPairReport>& reports) {
  std::vector<ContactSeriesPair> pairs;
  for (const ContactPairReport& report : reports)
    pairs.push_back({report.body_a, report.body_b, report.hard.has_value()});
  return pairs;
}

HardContactReport impacts_of(const GroupHistory& history) {
  return {static_cast<int>(history.impacts),
          history.fastest_impact,
          history.last_impact,
          history.impact_impulse,
          history.impact_loss,
          history.impact_friction_loss,
          history.persistent_since};
}

}  // namespace

ContactMonitor::ContactMonitor(const CaptureProblem& problem, const CaptureSystem& free, const MovingFrame& frame)
    : frame_(frame), reports_(reports_of(problem, free)), series_(pairs_of_series(reports_)) {}

void ContactMonitor::put(const CaptureSystem&, const PhaseSample& sample, SeriesRow& row) const {
  const ContactSet* set = sample.dynamics ? sample.dynamics->setup().contacts.get() : nullptr;
  std::vector<ContactSample> samples(reports_.size());
  for (std::size_t g = 0; g < samples.size(); ++g) {
    ContactSample& one = samples[g];
    if (set || !instant_.empty()) {
      const GroupContact& group = set ? set->group(g) : instant_[g];
      one = {group.touches, frame_.place(sample.time) + group.p_WC, group.force_on_b, group.normal_force, group.depth};
    }
    if (!reports_[g].hard) continue;
    const HardContactReport impacts = set ? impacts_of(set->history(g)) : *reports_[g].hard;
    one.impacts = impacts.impacts, one.impact_impulse = impacts.impulse;
  }
  series_.put(samples, row);
}

void ContactMonitor::begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) {
  system_ = &system, set_ = dynamics.setup().contacts.get();
  kinematics_ = Kinematics(system.model);
  integrals_.assign(reports_.size(), {});
  stored_.assign(reports_.size(), std::nan(""));
  peaks_ = ContactPeaks(reports_.size());
}

// Step => the integrals so far, peaks, and the energy balance of each pair in contact.
void ContactMonitor::step(const PhaseStep& step) {
  if (!set_) return;
  const auto move_to = [&](double t) { forward_kinematics(system_->model, step.state_at(t), kinematics_); };
  bool any = false;
  for (std::size_t g = 0; g < reports_.size(); ++g) {
    if (!set_->history(g).since) continue;
    any = true;
    if (!std::isnan(stored_[g])) continue;
    move_to(step.begin);
    stored_[g] = set_->elastic_energy(g, kinematics_);
  }
  if (!any) return;
  search_peaks(step);
  const PhaseSample end = step.at(step.end);
  integrals_ = end.integrals.contacts;
  forward_kinematics(system_->model, end.state, kinematics_);
  for (std::size_t g = 0; g < reports_.size(); ++g) check_energy(g);
  time_ = step.end;
}

// Step => the largest force and depth of each pair so far.
void ContactMonitor::search_peaks(const PhaseStep& step) {
  peaks_.step(*set_, step.begin, step.end, step.fresh, [&](double t) {
    forward_kinematics(system_->model, step.state_at(t), kinematics_);
    wrenches_.clear();
    set_->evaluate(kinematics_, wrenches_);
  });
  for (std::size_t g = 0; g < reports_.size(); ++g) note_peak(reports_[g], peaks_.peaks()[g], 0);
}

// Peaks since `begin` => the report of their pair.
void ContactMonitor::note_peak(ContactPairReport& report, const ContactPeak& peak, double begin) const {
  report.largest_depth = std::max(report.largest_depth, peak.depth);
  if (peak.beyond_model && !report.beyond_model) {
    report.beyond_model = true;
    report.beyond_model_since = begin + peak.beyond_model->time, report.beyond_model_depth = peak.beyond_model->depth;
  }
  if (!(peak.force > report.peak_force)) return;
  report.peak_force = peak.force, report.peak_time = begin + peak.time;
  report.peak_point = frame_.place(report.peak_time) + peak.p_WC;
}

// Work of the forces + change of elastic energy + dissipated energy = 0 (23.1), until the pair leaves the model: beyond
// it forces may jump (23.14).
void ContactMonitor::check_energy(std::size_t group) {
  if (std::isnan(stored_[group])) return;
  const ContactIntegrals& sum = integrals_[group];
  const double stored = set_->elastic_energy(group, kinematics_);
  reports_[group].elastic_energy = stored;
  if (reports_[group].beyond_model) return;
  const double error = std::abs(sum.work + stored - stored_[group] + sum.damping + sum.friction);
  if (!(error <= residual_)) residual_ = error;
  exchanged_ = std::max({exchanged_, stored, std::abs(sum.work), sum.damping, sum.friction});
}

// Work of the impulses + energy lost by restitution and friction = 0 in all impacts so far, over all pairs: in an
// impact of several, pairs exchange work (23.17), also with the contacts of impact laws.
void ContactMonitor::check_impacts(const ContactSet& contacts) {
  double work = with_others_, lost = 0;
  for (std::size_t g = 0; g < reports_.size(); ++g) {
    const GroupHistory& history = contacts.history(g);
    work += history.impact_work, lost += history.impact_loss + history.impact_friction_loss;
  }
  const double error = std::abs(work + lost);
  if (work != 0 && !(error <= residual_)) residual_ = error;
  exchanged_ = std::max({exchanged_, std::abs(work), std::abs(lost)});
}

void ContactMonitor::end_phase(double) {
  if (!set_) return;
  check_impacts(*set_);
  for (std::size_t g = 0; g < reports_.size(); ++g) {
    add_motion(g, integrals_[g], set_->history(g), time_);
  }
  set_ = nullptr;
}

// A phase or an impact that ended at `time`: its integrals, and the history until then => added to the report.
void ContactMonitor::add_motion(std::size_t group, const ContactIntegrals& sum, const GroupHistory& history,
                                double time) {
  ContactPairReport& report = reports_[group];
  report.impulse += sum.impulse, report.slip_distance += sum.slip;
  report.damping_loss += sum.damping, report.friction_loss += sum.friction;
  if (report.hard) {
    report.impulse += history.impact_impulse - report.hard->impulse;  // since the last call
    report.hard = impacts_of(history);
  }
  report.touches = history.touches, report.first_time = history.first_time;
  report.touches_at_end = history.since.has_value();
  report.duration = history.duration + (history.since ? time - *history.since : 0);
  if (!report.touches_at_end) report.elastic_energy = 0;
}

// Impact with its integrals, peaks and energy errors => added to the reports and to the ledger's check.
void ContactMonitor::add_impact(const ImpactShapes& impact, double end) {
  if (!impact.touched) return;
  for (std::size_t g = 0; g < reports_.size(); ++g) {
    ContactPairReport& report = reports_[g];
    note_peak(report, impact.peaks[g], impact.begin);
    report.elastic_energy = impact.elastic_energy[g];
    add_motion(g, impact.integrals[g], impact.contacts.history(g), end);
  }
  if (!(impact.energy_error <= residual_)) residual_ = impact.energy_error;
  exchanged_ = std::max(exchanged_, impact.energy_exchanged);
  check_impacts(impact.contacts);
}

void ContactMonitor::add_hard_impact(const ContactSet& contacts, double time, double exchanged) {
  with_others_ += exchanged;
  for (std::size_t g = 0; g < reports_.size(); ++g) {
    if (reports_[g].hard) add_motion(g, {}, contacts.history(g), time);
  }
  check_impacts(contacts);
}

void ContactMonitor::write(CaptureResult& result) const {
  if (reports_.empty()) return;
  result.contacts = reports_;
  const double scale = std::max(exchanged_, result.ledger.scale.energy);
  result.ledger.entries.push_back({"contact_energy_residual", residual_ > 0 ? residual_ / scale : residual_, 1e-8, "1",
                                   "largest |work of the contact forces + elastic energy + energy dissipated by "
                                   "damping and friction| of a pair until an overlap is too deep for the model, or "
                                   "of all impacts together, over the largest of these and the kinetic energy",
                                   exchanged_ > 0});
  if (std::string warning = contact_warning(result); !warning.empty()) result.warnings.push_back(std::move(warning));
}

}  // namespace grapnel
