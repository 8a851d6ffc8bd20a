#pragma once

/// @file
/// A fixed number of values in aligned memory. Lane code has no standard containers of doubles: what a translation unit
/// for one instruction set instantiates of them could be linked into portable code. The tag S, a pack, keeps the names
/// apart.

#include <type_traits>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel::lanes {

template <class S, class T = S>
class LaneArray {
 public:
  explicit LaneArray(int size) : data_(new T[static_cast<unsigned long>(size > 0 ? size : 1)]()), size_(size) {
    if constexpr (std::is_convertible_v<double, T>) {
      for (int i = 0; i < size; ++i) data_[i] = T(0);
    }
  }
  LaneArray(const LaneArray&) = delete;
  LaneArray& operator=(const LaneArray&) = delete;
  ~LaneArray() { delete[] data_; }
  GRAPNEL_INLINE T& operator[](int i) { return data_[i]; }
  GRAPNEL_INLINE const T& operator[](int i) const { return data_[i]; }
  GRAPNEL_INLINE T* data() { return data_; }
  GRAPNEL_INLINE const T* data() const { return data_; }
  GRAPNEL_INLINE int size() const { return size_; }

 private:
  T* data_;
  int size_;
};

}  // namespace grapnel::lanes
