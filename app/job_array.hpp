#pragma once

/// @file
/// Which part of a campaign is this process's.

#include <cstdint>
#include <functional>
#include <string>

namespace grapnel::app {

/// Part `number`, counted from 0, of `count`.
struct JobShard {
  std::uint64_t number = 0, count = 1;
  bool by_slurm = false;  // as the environment says

  bool is_part() const { return count > 1; }
  /// "3/8": as --shard takes it, counted from 1.
  std::string text() const;
  /// The name of its lock: "task-3-of-8".
  std::string writer() const;
};

/// Reads an environment variable; null if it is not set.
using Environment = std::function<const char*(const char*)>;

/// "i/N" with 1 <= i <= N; "slurm": SLURM_ARRAY_TASK_ID among SLURM_ARRAY_TASK_MIN, _MAX, _STEP; empty: the same where
/// they are set, else the whole. @throws std::invalid_argument saying what is wrong
JobShard job_shard(const std::string& argument, const Environment& environment);

}  // namespace grapnel::app
