#pragma once

/// @file
/// Independent cases on several threads, with results that do not depend on how many.

#include <cstddef>
#include <functional>
#include <stop_token>

#include "grapnel/study/run_case.hpp"

namespace grapnel {

/// What is done about a case, by number: a function of the number alone, called from any thread.
using CaseWork = std::function<CaseRow(std::size_t)>;
/// Takes rows in the order of their numbers, without gaps, one at a time.
using CaseSink = std::function<void(CaseRow&&)>;

/// Does the cases `begin` to `end` (not included). Threads take the next number each; rows that come early wait for
/// those before them. `finished` is told of every case as it ends, in any order, one at a time. After a stop request,
/// cases under way end and go to the sink as far as no number before them is missing. Rethrows what `work`, `finished`
/// or `sink` throw first; no case is begun after that.
void run_cases(std::size_t begin, std::size_t end, int threads, const CaseWork& work, const CaseSink& sink,
               const std::function<void(const CaseRow&)>& finished = {}, std::stop_token stop = {});

}  // namespace grapnel
