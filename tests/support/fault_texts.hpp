#pragma once

/// @file
/// The messages of rejected files, as tests compare them.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/text/faults.hpp"

namespace grapnel::test {

/// All messages of an error, without the path of `folder`.
inline std::vector<std::string> fault_texts(const InputError& error, const std::filesystem::path& folder) {
  std::vector<std::string> texts;
  const std::string prefix = folder.string() + "/";
  for (const Fault& fault : error.faults()) {
    std::string text = fault.text();
    for (std::size_t at = 0; (at = text.find(prefix)) != std::string::npos;) text.erase(at, prefix.size());
    texts.push_back(text);
  }
  return texts;
}

/// The messages with which `load` rejects the file, without the path of its folder; empty if it is accepted.
template <typename Load>
std::vector<std::string> faults_of_loading(const std::filesystem::path& file, Load&& load) {
  try {
    load(file);
  } catch (const InputError& error) {
    return fault_texts(error, file.parent_path());
  }
  return {};
}

}  // namespace grapnel::test
