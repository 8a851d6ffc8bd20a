#pragma once

/// @file
/// Impulses at grasps and momentum of measured motion, from a run's model and a log (docs/theory, section 25).

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/compare/impulse_report.hpp"
#include "grapnel/compare/measured_momentum.hpp"
#include "grapnel/text/override.hpp"

namespace grapnel {

struct ImpulseOptions {
  std::filesystem::path scenario;   // with the model; empty: as the run stored it
  std::vector<Override> overrides;  // of the scenario
  /// Contacts in the run's time; empty: detected. An end after the begin is the duration of a compliant contact.
  std::vector<ContactTime> contacts;
  std::optional<double> window;  // of the polynomials [s]; empty: chosen
  double false_alarms = 0.01;    // expected number of false contacts in the log
  bool momentum = true;          // over time, too
};

struct MeasuredImpulses {
  ImpulseReport report;
  std::vector<MomentumCurve> momentum;
};

/// @throws InputError with all errors of run, log, mapping and options
MeasuredImpulses measured_impulses(const std::filesystem::path& run_folder, const std::filesystem::path& log,
                                   const std::filesystem::path& mapping, const ImpulseOptions& options);
/// The same for quantities that have been read.
MeasuredImpulses measured_impulses(const RunModel& run, const AlignedLog& log, const ImpulseOptions& options);

}  // namespace grapnel
