#pragma once

/// @file
/// A campaign without simulation: rows depend only on their indices. For tests of storing and running.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/campaign/shard_store.hpp"
#include "grapnel/result/atomic_file.hpp"

namespace grapnel::test {

/// Two inputs, three columns, one criterion; no problems.
Campaign fake_campaign(std::uint64_t cases);
/// A row with numbers of all kinds; every seventh failed, every eleventh unreachable.
CaseRow fake_row(std::uint64_t k);
/// fake_row() of every case.
BlockWork fake_work();

/// Whether two rows are the same bit for bit.
bool same_row(const CaseRow& a, const CaseRow& b);

/// All rows in a folder.
std::vector<CaseRow> rows_in(const std::filesystem::path& folder, const Campaign& campaign);
/// Expects `total` rows in the folder, equal to fake_row().
void expect_fake_rows(const std::filesystem::path& folder, const Campaign& campaign, std::uint64_t total);

using TemporaryFolder = ScratchFolder;

std::string bytes_of(const std::filesystem::path& path);
void write_bytes(const std::filesystem::path& path, const std::string& bytes);

}  // namespace grapnel::test
