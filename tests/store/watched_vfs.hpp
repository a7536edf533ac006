#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace thermbal::test {

/// One thing that SQLite did to a file, or an acknowledgement that the writer gave.
struct FileOperation {
    enum class Kind : std::uint8_t { write, truncate, sync, remove, acknowledge };
    Kind kind = Kind::write;
    std::string file;         ///< name without folder
    std::int64_t offset = 0;  ///< truncate: the new size; acknowledge: the scan
    std::string bytes;
};

/// The default VFS of this process from install_watched_vfs() on: hands everything on to the operating
/// system's, keeps a record when asked to, and fails writes when asked to.
enum class WriteFault : std::uint8_t { none, full, io_error, sync_error, read_only };
void install_watched_vfs();
void set_write_fault(WriteFault fault);
/// The file of this name (without folder) cannot be opened from now on; empty: every one can.
void refuse_to_open(std::string name);
void start_record();
std::vector<FileOperation> take_record();
/// Puts into the record that `scan` is acknowledged now.
void record_acknowledge(std::int64_t scan);

/// What a disk may hold when the power goes after so many operations: everything up to each file's last sync,
/// and of what came after it any subset of its 512-byte sectors, in any order.
class PowerCut {
  public:
    struct Disk {
        bool syncs_count = true;  ///< false: a disk that lies; the control of the experiment
    };
    PowerCut(const std::vector<FileOperation>& record, std::size_t operations, Disk disk);

    /// Writes the files into a folder. `random` chooses what of the unsynced is there.
    void write_to(const std::filesystem::path& folder, std::mt19937& random) const;

    std::int64_t acknowledged() const { return acknowledged_; }  ///< newest scan; -1: none

  private:
    struct File {
        std::string durable;
        bool exists_durably = false;
        std::vector<FileOperation> unsynced;
    };
    void apply(const FileOperation& operation, Disk disk);

    std::map<std::string, File> files_;
    std::int64_t acknowledged_ = -1;
};

}  // namespace thermbal::test
