#pragma once

/// @file
/// What no random numbers can have: the parameters of distributions that contradict each other. They say what is wrong,
/// on one line; nothing if nothing is. `name` is that of the distribution in the file, "sphere.length.normal".

#include <string>
#include <vector>

#include "grapnel/campaign/distribution.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Of one that is cut: an interval without numbers, or in which doubles find no probability.
std::string cut_fault(const std::string& name, const NumberDistribution& distribution);

/// Of a length, which is not below 0. `given`: what the file says, a number or {normal: ...} and the like.
std::string length_fault(const std::string& name, const Node& given, const NumberDistribution& distribution);

/// Of a covariance that is indefinite: why, where two numbers are enough to see it.
std::string why_indefinite(const std::vector<double>& matrix, std::size_t n);

}  // namespace grapnel
