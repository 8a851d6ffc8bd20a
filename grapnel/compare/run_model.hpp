#pragma once

/// @file
/// The model of a run and its states, from the run's folder: for quantities that follow from measurements and masses.

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/compare/run_curve.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/text/override.hpp"

namespace grapnel {

/// A contact of the run: the grasps that close or hold in it.
struct RunContact {
  struct Grasp {
    std::string end_effector, target;
    Vector3d impulse, angular_impulse;  // on the robot, in W, at the contact point [N s], [N m s]
  };
  double time = 0, end = 0;  // [s]; equal for an instantaneous impact
  std::vector<Grasp> grasps;
  std::vector<std::string> held_joints;  // drives or brakes that kept a rate: their impulses are unknown
};

/// A body or frame of the model by the path of its series: "base", "links/NAME", "end_effectors/NAME", "targets/NAME".
struct PlacedFrame {
  int body = 0;
  Posed X_BF = Posed::identity();
};

/// Problem, model with free targets, contacts, and states of a run.
class RunModel {
 public:
  /// The scenario is that of `scenario`, or, if the path is empty, the text that the run's folder contains; `overrides`
  /// apply to it. @throws InputError
  RunModel(const std::filesystem::path& run_folder, const std::filesystem::path& scenario,
           std::span<const Override> overrides);

  const CaptureProblem& problem() const { return problem_; }
  const CaptureSystem& system() const { return system_; }
  const Model& model() const { return system_.model; }
  const std::vector<RunContact>& contacts() const { return contacts_; }
  /// The state of the free system at a time; at a contact that after it, or just before it.
  State state_at(double time, bool before = false) const;
  double begin() const { return begin_; }
  double end() const { return end_; }

  std::optional<PlacedFrame> find_frame(const std::string& path) const;
  /// The body that a joint or wheel moves, by its name in series.
  std::optional<int> find_joint(const std::string& series, const std::string& name) const;

 private:
  CaptureProblem problem_;
  CaptureSystem system_;
  std::vector<RunContact> contacts_;
  std::map<std::string, RunCurve> curves_;
  std::map<std::string, std::vector<std::string>> components_;
  double begin_ = 0, end_ = 0;
};

}  // namespace grapnel
