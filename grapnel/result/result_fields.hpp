#pragma once

/// @file
/// The descriptions of what summary.json is made of: every structure of a result has one table of its fields, with
/// key, unit and meaning. What is written, published and documented of a field follows from its line there.
/// motion_fields.cpp: bodies, plans, grasps; impact_fields.cpp: impacts; summary_fields.cpp: the rest and the document.

#include <string>

#include "grapnel/describe/type.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

template <>
const Type& type_of<Captured>();
template <>
const Type& type_of<Verdict>();
template <>
const Type& type_of<BodyMotion>();
template <>
const Type& type_of<PhaseEnd>();
template <>
const Type& type_of<GraspOutcome>();
template <>
const Type& type_of<PlanReport>();
template <>
const Type& type_of<GraspImpulse>();
template <>
const Type& type_of<ForceProfile>();
template <>
const Type& type_of<SpeedLimit>();
template <>
const Type& type_of<ImpactReport>();
template <>
const Type& type_of<GraspLoad>();
template <>
const Type& type_of<LedgerScale>();

/// The document: a result and the version of Grapnel that computed it. Refers to the result.
struct Summary {
  const CaptureResult& result;
  std::string version;
};
template <>
const Type& type_of<Summary>();

}  // namespace grapnel
