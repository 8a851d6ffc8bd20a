#pragma once

/// @file
/// Flexible modes: frequencies of a capture's system in a posture, and the dependence of a plastic impact on the
/// responding modes.

#include "grapnel/capture/impact_report.hpp"

namespace grapnel {

/// Frequencies of the system in its posture, with base held or free and joints braked or free; the slowest ones. The
/// system has joints with springs.
ElasticReport elastic_report(const CaptureSystem& system, const State& state, std::string at, double time);

/// Frequency of its fastest mode, with base and joints free: constraints never increase it, since M* of (22.7) is then
/// minimal [Hz].
double fastest_vibration(const CaptureSystem& system, const State& state);

/// Magnitudes of a plastic impact's impulses if only the n slowest modes of the robot responded, for n from 0 to all,
/// with base and joints as in the impact. With n modes D: velocities v+ = v- + T z, with T of the velocities without
/// springs and D, and (7.5) with T^T M T and J T, (22.8). Components that closed loops leave undetermined are
/// minimum-norm in the metric (7.8). Empty without flexible modes.
std::vector<RetainedModes> impulses_by_modes(const ImpactTask& task);

/// Rates of the modes of vibration at `frequency` [Hz] and above, which keep their values in an impact once the rates
/// in `held` have theirs, in which these modes do not participate: x^T M v of (22.8), first in the list of held rates.
std::vector<HeldRate> rates_of_fast_modes(const Model& model, const State& state, std::span<const HeldRate> held,
                                          double frequency);

/// A warning if an impact depends on by_modes; empty: none.
std::string describe_dependence_on_modes(const ImpactReport& report);

}  // namespace grapnel
