#pragma once

/// @file
/// What bends: frequencies of a capture's system in a posture, and how a plastic impact depends on the modes that
/// answer it.

#include "grapnel/impact_report/impact_report.hpp"

namespace grapnel {

/// Frequencies of the system in its posture, base held or free, joints braked or free; the slowest. The system has
/// joints with springs.
ElasticReport elastic_report(const CaptureSystem& system, const State& state, std::string at, double time);

/// Frequency of its fastest mode, with base and joints free: nothing that is held makes one faster, since M* of (22.7)
/// is then at its least [Hz].
double fastest_vibration(const CaptureSystem& system, const State& state);

/// Magnitudes of a plastic impact's impulses if only the n slowest modes of the robot could answer it, for n from 0 to
/// all, with base and joints as they are in the impact. With n modes D: velocities v+ = v- + T z, T of what is free of
/// springs and of D, and (7.5) with T^T M T and J T, (22.8). Components that closed loops leave open are the least ones
/// in the metric (7.8). Empty where nothing bends.
std::vector<ModesKept> impulses_by_modes(const ImpactTask& task);

/// Rates of the modes of vibration at `frequency` [Hz] and above, which an impact that they do not answer leaves as
/// they are once the rates in `held` have their values, in which these modes have no part: x^T M v of (22.8), first in
/// the list of held rates.
std::vector<HeldRate> rates_of_fast_modes(const Model& model, const State& state, std::span<const HeldRate> held,
                                          double frequency);

/// What by_modes says of an impact that rests on it; empty: nothing that anybody should know.
std::string describe_dependence_on_modes(const ImpactReport& report);

}  // namespace grapnel
