#pragma once

/// @file
/// The JSON documents of a capture's result folder: summary.json, scene.json, scenario.json. The field tables
/// type_of<...>() below describe their contents.

#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/result/capture_result.hpp"
#include "grapnel/result/scene.hpp"

namespace grapnel {

/// summary.json: pretty JSON with keys in a fixed order and a newline at the end. Numbers read back to the same double;
/// NaN and infinities, which JSON lacks, become null. Phases that did not happen are absent. `version`: of Grapnel.
std::string summary_json(const CaptureResult& result, std::string_view version);

/// scene.json: a scene, its scenario, and the version of Grapnel. Refers to the scene.
struct SceneDocument {
  const Scene* scene;
  std::string scenario_name, scenario_sha256, version;
};
template <>
const Type& type_of<SceneDocument>();

/// The input texts of a capture, stored with its results as scenario.json (docs/formats/summary.md), so that reports
/// can show and compare them. Files are identified by their role, because names differ between machines.
struct SourceTexts {
  struct File {
    std::string part;  // "scenario", "robot", "bus", "target NAME" of a ready-made one, "trajectory"
    std::string text;  // empty where the file is larger than kLargestText
    std::size_t bytes = 0;
  };
  /// Larger files (trajectories) are not stored.
  static constexpr std::size_t kLargestText = 256 * 1024;  // [bytes]

  std::string description;            // description of the scenario by its author
  std::vector<File> files;            // the scenario first
  std::vector<std::string> settings;  // "path=value" of every --set, in their order

  void add(std::string part, const std::string& text);
};

/// scenario.json: JSON with keys in a fixed order and a newline at the end.
std::string source_texts_json(const SourceTexts& texts, std::string_view scenario_name,
                              std::string_view scenario_sha256, std::string_view version);

// Descriptions of summary.json: every structure of a result has one table of its fields, with key, unit and meaning.
// The writer, the schema and the documentation follow from this table. motion_fields.cpp: bodies, plans, grasps;
// impact_fields.cpp: impacts; contact_fields.cpp: contacts between shapes; summary_fields.cpp: the rest and the
// document.

template <>
const Type& type_of<Captured>();
template <>
const Type& type_of<Verdict>();
template <>
const Type& type_of<BodyMotion>();
template <>
const Type& type_of<PhaseEnd>();
template <>
const Type& type_of<MotionPhaseReport::End>();
template <>
const Type& type_of<MotionPhaseReport>();
template <>
const Type& type_of<GraspOutcome>();
template <>
const Type& type_of<LossReport>();
template <>
const Type& type_of<SlipEnd>();
template <>
const Type& type_of<SlipReport>();
template <>
const Type& type_of<PlanTerm>();
template <>
const Type& type_of<WheelShare>();
template <>
const Type& type_of<PlannedPath>();
template <>
const Type& type_of<WindowPoint>();
template <>
const Type& type_of<WindowReport>();
template <>
const Type& type_of<PlannedContact>();
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
const Type& type_of<MinimumClearance>();
template <>
const Type& type_of<ElasticModeReport>();
template <>
const Type& type_of<LawReport::Law>();
template <>
const Type& type_of<LawReport::Squeeze>();
template <>
const Type& type_of<LawReport>();
template <>
const Type& type_of<JointReport>();
template <>
const Type& type_of<SaturationReport::Actuator>();
template <>
const Type& type_of<SaturationReport::Quantity>();
template <>
const Type& type_of<SaturationReport>();
template <>
const Type& type_of<ActuatorUse>();
template <>
const Type& type_of<TendonReport>();
template <>
const Type& type_of<Stability>();
template <>
const Type& type_of<StabilityReport>();
template <>
const Type& type_of<LoopMargin>();
template <>
const Type& type_of<LinearStability>();
template <>
const Type& type_of<ControlLoopReport>();
template <>
const Type& type_of<RestReport>();
template <>
const Type& type_of<StopImpact>();
template <>
const Type& type_of<ContactPairReport>();
template <>
const Type& type_of<StagesReport::Stage>();
template <>
const Type& type_of<StagesReport::Cage>();
template <>
const Type& type_of<StagesReport::Failure>();
template <>
const Type& type_of<StagesReport>();
template <>
const Type& type_of<HardContactReport>();
template <>
const Type& type_of<WheelReport>();
template <>
const Type& type_of<GyroReport>();
template <>
const Type& type_of<GyrosReport>();
template <>
const Type& type_of<ThrusterReport>();
template <>
const Type& type_of<ThrustersReport>();
template <>
const Type& type_of<PeakLoad>();
template <>
const Type& type_of<NavigationReport>();
template <>
const Type& type_of<LoopReport>();
template <>
const Type& type_of<IdentificationReport>();
template <>
const Type& type_of<ControlReport>();
template <>
const Type& type_of<SensorReport>();
template <>
const Type& type_of<ReleaseReport>();
template <>
const Type& type_of<LedgerScale>();

/// The document: a result and the version of Grapnel that computed it. Refers to the result.
struct Summary {
  const CaptureResult* result;
  std::string version;
};
template <>
const Type& type_of<Summary>();

}  // namespace grapnel
