#pragma once

/// @file
/// Models of MuJoCo from text.

#include <mujoco/mujoco.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

namespace grapnel::testing {

/// Compiles an MJCF document; throws std::runtime_error with MuJoCo's message. MuJoCo reads models from files, real or
/// virtual. The caller deletes the model.
inline mjModel* load_mjcf(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const char* name = "model.xml";
  mj_makeEmptyFileVFS(files.get(), name, static_cast<int>(xml.size()));
  std::copy(xml.begin(), xml.end(), static_cast<char*>(files->filedata[mj_findFileVFS(files.get(), name)]));
  char error[1000] = "";
  mjModel* model = mj_loadXML(name, files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("MuJoCo: ") + error + "\n" + xml);
  return model;
}

}  // namespace grapnel::testing
