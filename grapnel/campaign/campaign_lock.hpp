#pragma once

/// @file
/// Exclusive access to a campaign's folder. A lock of the operating system is used if available: it ends with its
/// process. Without such locks (some network file systems), and between machines, a file with a heartbeat is used.
/// Thread safety: one thread per object; each object has a separate thread for the heartbeat.

#include <chrono>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

namespace grapnel {

/// A campaign's folder cannot be used; what() states the reason and the remedy.
struct StoreError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Another process writes to it.
struct FolderInUse : StoreError {
  using StoreError::StoreError;
};

/// During its lifetime no other process has the folder; with the name of a writer, no process without a name or with
/// the same name. A lock whose process has ended is taken over.
class CampaignLock {
 public:
  /// Interval of the heartbeat, and the time without a heartbeat after which a holder on another machine is considered
  /// to have ended.
  static constexpr std::chrono::seconds kBeat{10}, kGone{90};

  /// `writer`: letters, digits, '-', '_'; empty: alone. @throws FolderInUse naming host, process and since when;
  /// std::runtime_error (disk)
  explicit CampaignLock(const std::filesystem::path& folder, const std::string& writer = "");
  ~CampaignLock();
  CampaignLock(const CampaignLock&) = delete;
  CampaignLock& operator=(const CampaignLock&) = delete;

  /// During its lifetime no other writer, named or not, holds such an object: for changes shared by named writers. The
  /// constructor waits.
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
