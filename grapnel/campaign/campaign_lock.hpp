#pragma once

/// @file
/// Who writes to a campaign's folder. The operating system's lock decides where there is one: it goes with its process,
/// however that ends. Where there is none (some network file systems), and between machines, a text with a heartbeat
/// does. Thread safety: one thread per object; each object has a thread of its own for the heartbeat.

#include <chrono>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

namespace grapnel {

/// Something about a campaign's folder that keeps this program from using it; what() says what, and what to do.
struct StoreError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Another process writes to it.
struct FolderInUse : StoreError {
  using StoreError::StoreError;
};

/// While it lives, no other process has the folder; with the name of a writer, none that has no name or the same.
/// A lock whose process is gone is taken over.
class CampaignLock {
 public:
  /// How often the holder marks the file, and after how long without a mark a holder on another machine counts as gone.
  static constexpr std::chrono::seconds kBeat{10}, kGone{90};

  /// `writer`: letters, digits, '-', '_'; empty: alone. @throws FolderInUse naming host, process and since when;
  /// std::runtime_error (disk)
  explicit CampaignLock(const std::filesystem::path& folder, const std::string& writer = "");
  ~CampaignLock();
  CampaignLock(const CampaignLock&) = delete;
  CampaignLock& operator=(const CampaignLock&) = delete;

  /// While it lives, no other writer, named or not, is between making and ending one: for what named writers change
  /// together. Waits.
  class Turn {
   public:
    explicit Turn(const CampaignLock& lock);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    const CampaignLock& lock_;
  };

 private:
  struct Held;
  std::unique_ptr<Held> held_;
};

}  // namespace grapnel
