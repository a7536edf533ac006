#include "watched_vfs.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>
#include <mutex>
#include <utility>

#include <sqlite3.h>

namespace thermbal::test {
namespace {

constexpr std::size_t sector = 512;

struct State {
    std::mutex mutex;
    WriteFault fault = WriteFault::none;
    std::string not_to_be_opened;
    bool recording = false;
    std::vector<FileOperation> record;
    sqlite3_vfs* real = nullptr;
};

State& state() {
    static State the_state;
    return the_state;
}

std::string name_of(const char* path) {
    return path == nullptr ? std::string() : std::filesystem::path(path).filename().string();
}

void note(FileOperation operation) {
    const std::lock_guard lock(state().mutex);
    if (state().recording && !operation.file.empty()) state().record.push_back(std::move(operation));
}

WriteFault fault() {
    const std::lock_guard lock(state().mutex);
    return state().fault;
}

std::string not_to_be_opened() {
    const std::lock_guard lock(state().mutex);
    return state().not_to_be_opened;
}

/// What SQLite allocates for an open file: this, and behind it the real one.
struct WatchedFile {
    sqlite3_file base;
    std::string* name;
    sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

WatchedFile& watched(sqlite3_file* file) {
    return *reinterpret_cast<WatchedFile*>(file);
}

const sqlite3_io_methods& real_methods(sqlite3_file* file) {
    return *watched(file).real()->pMethods;
}

int close_file(sqlite3_file* file) {
    const int code = real_methods(file).xClose(watched(file).real());
    delete std::exchange(watched(file).name, nullptr);
    return code;
}

int write_file(sqlite3_file* file, const void* data, int count, sqlite3_int64 offset) {
    switch (fault()) {
        case WriteFault::full:
            return SQLITE_FULL;
        case WriteFault::io_error:
            return SQLITE_IOERR_WRITE;
        case WriteFault::read_only:
            return SQLITE_READONLY;
        case WriteFault::none:
        case WriteFault::sync_error:
            break;
    }
    const int code = real_methods(file).xWrite(watched(file).real(), data, count, offset);
    if (code == SQLITE_OK) {
        note({FileOperation::Kind::write, *watched(file).name, offset,
              std::string(static_cast<const char*>(data), static_cast<std::size_t>(count))});
    }
    return code;
}

int truncate_file(sqlite3_file* file, sqlite3_int64 size) {
    const int code = real_methods(file).xTruncate(watched(file).real(), size);
    if (code == SQLITE_OK) note({FileOperation::Kind::truncate, *watched(file).name, size, {}});
    return code;
}

int sync_file(sqlite3_file* file, int flags) {
    if (fault() == WriteFault::sync_error) return SQLITE_IOERR_FSYNC;
    const int code = real_methods(file).xSync(watched(file).real(), flags);
    if (code == SQLITE_OK) note({FileOperation::Kind::sync, *watched(file).name, 0, {}});
    return code;
}

const sqlite3_io_methods& methods() {
    static const sqlite3_io_methods table = {
        .iVersion = 2,
        .xClose = close_file,
        .xRead =
            [](sqlite3_file* file, void* to, int count, sqlite3_int64 at) {
                return real_methods(file).xRead(watched(file).real(), to, count, at);
            },
        .xWrite = write_file,
        .xTruncate = truncate_file,
        .xSync = sync_file,
        .xFileSize =
            [](sqlite3_file* file, sqlite3_int64* size) {
                return real_methods(file).xFileSize(watched(file).real(), size);
            },
        .xLock = [](sqlite3_file* file,
                    int level) { return real_methods(file).xLock(watched(file).real(), level); },
        .xUnlock = [](sqlite3_file* file,
                      int level) { return real_methods(file).xUnlock(watched(file).real(), level); },
        .xCheckReservedLock =
            [](sqlite3_file* file, int* out) {
                return real_methods(file).xCheckReservedLock(watched(file).real(), out);
            },
        .xFileControl =
            [](sqlite3_file* file, int what, void* with) {
                return real_methods(file).xFileControl(watched(file).real(), what, with);
            },
        .xSectorSize = [](sqlite3_file*) { return static_cast<int>(sector); },
        // No promises of the disk: not that a sector is written whole with its neighbours, not that order is
        // kept.
        .xDeviceCharacteristics = [](sqlite3_file*) { return 0; },
        .xShmMap =
            [](sqlite3_file* file, int region, int size, int extend, void volatile** memory) {
                return real_methods(file).xShmMap(watched(file).real(), region, size, extend, memory);
            },
        .xShmLock =
            [](sqlite3_file* file, int offset, int count, int flags) {
                return real_methods(file).xShmLock(watched(file).real(), offset, count, flags);
            },
        .xShmBarrier = [](sqlite3_file* file) { real_methods(file).xShmBarrier(watched(file).real()); },
        .xShmUnmap = [](sqlite3_file* file,
                        int remove) { return real_methods(file).xShmUnmap(watched(file).real(), remove); },
        .xFetch = nullptr,
        .xUnfetch = nullptr,
    };
    return table;
}

int open_file(sqlite3_vfs*, const char* path, sqlite3_file* file, int flags, int* out_flags) {
    WatchedFile& opened = watched(file);
    opened.base.pMethods = nullptr;
    if (path != nullptr && name_of(path) == not_to_be_opened()) return SQLITE_CANTOPEN;
    const int code = state().real->xOpen(state().real, path, opened.real(), flags, out_flags);
    if (opened.real()->pMethods == nullptr) return code;
    opened.name = new std::string(name_of(path));
    opened.base.pMethods = &methods();
    return code;
}

int remove_file(sqlite3_vfs*, const char* path, int sync_folder) {
    const int code = state().real->xDelete(state().real, path, sync_folder);
    if (code == SQLITE_OK) note({FileOperation::Kind::remove, name_of(path), sync_folder, {}});
    return code;
}

void put_bytes(std::string& file, std::size_t offset, const std::string& bytes) {
    if (file.size() < offset + bytes.size()) file.resize(offset + bytes.size(), '\0');
    file.replace(offset, bytes.size(), bytes);
}

void apply_whole(std::string& file, const FileOperation& operation) {
    const auto offset = static_cast<std::size_t>(operation.offset);
    if (operation.kind == FileOperation::Kind::truncate) {
        file.resize(offset);
    } else {
        put_bytes(file, offset, operation.bytes);
    }
}

void apply_some_sectors(std::string& file, const FileOperation& operation, std::mt19937& random) {
    std::bernoulli_distribution there(0.5);
    if (operation.kind == FileOperation::Kind::truncate) {
        if (there(random)) apply_whole(file, operation);
        return;
    }
    for (std::size_t at = 0; at < operation.bytes.size(); at += sector) {
        if (there(random))
            put_bytes(file, static_cast<std::size_t>(operation.offset) + at,
                      operation.bytes.substr(at, sector));
    }
}

}  // namespace

void install_watched_vfs() {
    static sqlite3_vfs vfs = [] {
        state().real = sqlite3_vfs_find(nullptr);
        sqlite3_vfs copy = *state().real;
        copy.zName = "watched";
        copy.szOsFile = static_cast<int>(sizeof(WatchedFile)) + state().real->szOsFile;
        copy.xOpen = open_file;
        copy.xDelete = remove_file;
        return copy;
    }();
    sqlite3_vfs_register(&vfs, 1);
}

void set_write_fault(WriteFault wanted) {
    const std::lock_guard lock(state().mutex);
    state().fault = wanted;
}

void refuse_to_open(std::string name) {
    const std::lock_guard lock(state().mutex);
    state().not_to_be_opened = std::move(name);
}

void start_record() {
    const std::lock_guard lock(state().mutex);
    state().recording = true;
    state().record.clear();
}

std::vector<FileOperation> take_record() {
    const std::lock_guard lock(state().mutex);
    state().recording = false;
    return std::exchange(state().record, {});
}

void record_acknowledge(std::int64_t scan) {
    note({FileOperation::Kind::acknowledge, "-", scan, {}});
}

PowerCut::PowerCut(const std::vector<FileOperation>& record, std::size_t operations, Disk disk) {
    for (std::size_t i = 0; i < operations && i < record.size(); ++i) apply(record[i], disk);
}

void PowerCut::apply(const FileOperation& operation, Disk disk) {
    if (operation.kind == FileOperation::Kind::acknowledge) {
        acknowledged_ = operation.offset;
        return;
    }
    File& file = files_[operation.file];
    switch (operation.kind) {
        case FileOperation::Kind::sync:
            if (!disk.syncs_count) break;
            for (const FileOperation& earlier : file.unsynced) apply_whole(file.durable, earlier);
            file.unsynced.clear();
            file.exists_durably = true;
            break;
        case FileOperation::Kind::remove:
            file = File{};
            break;
        default:
            file.unsynced.push_back(operation);
            break;
    }
}

void PowerCut::write_to(const std::filesystem::path& folder, std::mt19937& random) const {
    for (const auto& [name, file] : files_) {
        if (name.ends_with("-shm")) continue;
        std::string content = file.durable;
        std::vector<FileOperation> unsynced = file.unsynced;
        std::ranges::shuffle(unsynced, random);
        for (const FileOperation& operation : unsynced) apply_some_sectors(content, operation, random);
        if (!file.exists_durably && content.empty()) continue;
        std::ofstream(folder / name, std::ios::binary) << content;
    }
}

}  // namespace thermbal::test
