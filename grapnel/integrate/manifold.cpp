#include "grapnel/integrate/manifold.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace grapnel {

std::vector<NumberRange> numbers_beside(int size, std::span<const NumberRange> ranges) {
  std::vector<NumberRange> others;
  int begin = 0;
  for (const NumberRange& range : ranges) {
    if (range.begin > begin) others.push_back({begin, range.begin});
    begin = range.end;
  }
  if (size > begin) others.push_back({begin, size});
  return others;
}

// Checks sizes and offsets of the manifold. @throws std::invalid_argument with the first error.
void validate(const Manifold& manifold) {
  const auto reject = [](const std::string& fault) { throw std::invalid_argument("Manifold: " + fault); };
  if (manifold.size < 0) reject("size is " + std::to_string(manifold.size) + ", must not be negative");
  const int controlled = manifold.controlled_size();
  if (controlled < 0 || controlled > manifold.size) {
    reject("controlled is " + std::to_string(controlled) + ", must lie in 0 … " + std::to_string(manifold.size));
  }
  std::vector<int> offsets = manifold.quaternions;
  std::sort(offsets.begin(), offsets.end());
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const int begin = offsets[i];
    const int end = begin + 4;
    const std::string name = "quaternion at offset " + std::to_string(begin);
    if (begin < 0 || end > manifold.size) {
      reject(name + " lies outside a state of " + std::to_string(manifold.size) + " numbers");
    }
    if (i > 0 && begin < offsets[i - 1] + 4) reject(name + " overlaps the one at " + std::to_string(offsets[i - 1]));
    if (begin < controlled && end > controlled) {
      reject(name + " straddles the end of the controlled part at " + std::to_string(controlled));
    }
  }
}

}  // namespace grapnel
