#include "job_array.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace grapnel::app {
namespace {

std::optional<std::uint64_t> number_in(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

JobShard stated(const std::string& argument) {
  const std::size_t slash = argument.find('/');
  const auto i = number_in(std::string_view(argument).substr(0, slash));
  const auto n = slash == std::string::npos ? std::nullopt : number_in(std::string_view(argument).substr(slash + 1));
  if (!i || !n || *i < 1 || *i > *n)
    throw std::invalid_argument(
        fmt::format("--shard: '{}' is neither i/N with i from 1 to N, as in 3/8, nor 'slurm'", argument));
  return {*i - 1, *n, false};
}

std::uint64_t variable(const char* name, const Environment& environment) {
  const char* text = environment(name);
  const auto number = text == nullptr ? std::nullopt : number_in(text);
  if (!number)
    throw std::invalid_argument(fmt::format("{} is {}, expected a number; say --shard i/N instead", name,
                                            text == nullptr ? "not set" : "'" + std::string(text) + "'"));
  return *number;
}

JobShard by_slurm(const Environment& environment) {
  const std::uint64_t id = variable("SLURM_ARRAY_TASK_ID", environment),
                      first = variable("SLURM_ARRAY_TASK_MIN", environment),
                      last = variable("SLURM_ARRAY_TASK_MAX", environment);
  const std::uint64_t step =
      environment("SLURM_ARRAY_TASK_STEP") == nullptr ? 1 : variable("SLURM_ARRAY_TASK_STEP", environment);
  if (step == 0 || id < first || id > last || (id - first) % step != 0)
    throw std::invalid_argument(fmt::format(
        "task {} is not one of {} to {} by {}, as SLURM_ARRAY_TASK_MIN, _MAX and _STEP say; say --shard i/N "
        "instead",
        id, first, last, step));
  const std::uint64_t count = (last - first) / step + 1;
  // Of --array=1,3,7 nobody could do the parts of tasks that do not exist.
  if (environment("SLURM_ARRAY_TASK_COUNT") != nullptr && variable("SLURM_ARRAY_TASK_COUNT", environment) != count)
    throw std::invalid_argument(fmt::format(
        "the array has {} tasks where {} to {} by {} would be {}: number them without gaps, or say --shard i/N",
        variable("SLURM_ARRAY_TASK_COUNT", environment), first, last, step, count));
  return {(id - first) / step, count, true};
}

}  // namespace

std::string JobShard::text() const { return fmt::format("{}/{}", number + 1, count); }
std::string JobShard::writer() const { return fmt::format("task-{}-of-{}", number + 1, count); }

JobShard job_shard(const std::string& argument, const Environment& environment) {
  if (argument == "slurm") return by_slurm(environment);
  if (!argument.empty()) return stated(argument);
  return environment("SLURM_ARRAY_TASK_ID") == nullptr ? JobShard{} : by_slurm(environment);
}

}  // namespace grapnel::app
