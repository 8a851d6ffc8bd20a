#pragma once

/// @file
/// Joint motion over time from a CSV file.

#include <memory>
#include <optional>
#include <string>

#include "grapnel/scenario/read_robot.hpp"

namespace grapnel {

/// A file whose text has been read and found clean.
struct TrajectoryFile {
  std::shared_ptr<const std::string> source;  // its path
  std::string text;
};

/// A header line time,JOINT,... and a line of numbers per sample; docs/formats/scenario.md describes it. Empty where
/// faults leave the motion in doubt.
std::optional<SampledMotion> read_trajectory(const TrajectoryFile& file, const ReadRobot& robot, FaultList& faults);

}  // namespace grapnel
