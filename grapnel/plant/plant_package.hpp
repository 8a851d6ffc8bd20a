#pragma once

/// @file
/// Contents of an exported plant: the scenario with all files that it names, its settings, and its variable parameters.
/// The package is a folder whose plant.json lists the contents.

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
  std::string token;  // identifies the list of variables
};

inline constexpr const char* kPlantFile = "plant.json";

std::string plant_json(const PlantPackage& package);
/// Reads a package from a folder. @throws PlantError.
PlantPackage read_plant(const std::filesystem::path& folder);
/// The plant of a package in a folder, with the given parameter values. @throws PlantError, InputError.
CaptureProblem load_plant(const PlantPackage& package, const std::filesystem::path& folder,
                          const std::vector<double>& values);

/// A package to be exported, with the local paths of its files.
struct GatheredPlant {
  PlantPackage package;  // without a token
  std::string assumed;   // a setting, path=value, added because the scenario lacks it; empty: none
  CaptureProblem plant;
  struct File {
    std::filesystem::path from;
    std::string to;  // in the folder
  };
  std::vector<File> files;
};

/// Reads a scenario and collects its files, which keep their relative locations. `parameters`: paths of numbers that
/// may be changed; "default": all numbers of the scenario's file in initial, targets, contact, impact and loads. A
/// scenario without control is sampled every 10 ms. @throws InputError, or PlantError if the scenario cannot be a plant
/// or a file is named by an absolute path.
GatheredPlant gather_plant(const std::filesystem::path& scenario, const std::vector<std::string>& settings,
                           const std::vector<std::string>& parameters, bool base_torque, std::vector<Fault>* warnings);

}  // namespace grapnel
