#pragma once

/// @file
/// What an exported plant carries: the scenario with all files that it names, what was set beside it, and which of its
/// numbers may be changed. It stands in a folder, in which plant.json says where what is.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/plant/plant_variables.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

struct PlantPackage {
  std::string scenario;               // its path in the folder
  std::vector<std::string> settings;  // path=value, as of --set
  bool base_torque = false;           // see plant_of()
  std::vector<PlantParameter> parameters;
  std::string token;  // says which variables belong to it
};

inline constexpr const char* kPlantFile = "plant.json";

std::string plant_json(const PlantPackage& package);
/// Of a folder. @throws PlantError.
PlantPackage read_plant(const std::filesystem::path& folder);
/// The plant of a package in a folder, with the parameters' values. @throws PlantError, InputError.
CaptureProblem load_plant(const PlantPackage& package, const std::filesystem::path& folder,
                          const std::vector<double>& values);

/// A package to be, with the files that belong to it, as they lie on this machine.
struct GatheredPlant {
  PlantPackage package;  // without a token
  std::string assumed;   // a setting, path=value, that the scenario lacked; empty: none
  CaptureProblem plant;
  struct File {
    std::filesystem::path from;
    std::string to;  // in the folder
  };
  std::vector<File> files;
};

/// Reads a scenario, and finds what it consists of. Files keep their places relative to each other. `parameters`: paths
/// of numbers that may be changed; of "default" all those of the scenario's file at initial, targets, contact, impact
/// and loads. A scenario without control is sampled every 10 ms. @throws InputError, or PlantError where it cannot be a
/// plant or a file is named by an absolute path.
GatheredPlant gather_plant(const std::filesystem::path& scenario, const std::vector<std::string>& settings,
                           const std::vector<std::string>& parameters, bool base_torque, std::vector<Fault>* warnings);

}  // namespace grapnel
