// What a descriptor is that another process has sent, found out without asking whoever sent it.
//
// A descriptor may lead to a file system that its sender serves (FUSE): fstat(), fstatfs(), read()
// and close() of such a file wait for him, for as long as he likes. So the questions here are those
// that the kernel answers by itself, whatever the file is; only once a descriptor is known to be a
// memfd or an anonymous pipe may it be looked at by other means.
#pragma once

#include <sys/types.h>

namespace arbiter::shm {

enum class ForeignKind {
  kMemfd,  // of ordinary pages: memory of the kernel's own, which nobody serves
  kPipe,   // made by pipe(); a FIFO in a directory is not one
  kOther,  // never to be looked at, nor closed where that must not take time
};

// Asks for the flags (an O_PATH descriptor is kOther, for it proves no right to what it names), for
// seals, which only memory has, and for the name that /proc shows. Takes no lock that a process of
// another user may hold, so it never blocks.
[[nodiscard]] ForeignKind foreign_kind(int fd) noexcept;

// Of a memfd or an anonymous pipe only: the user who made it (the file system's user id of the
// maker, mapped into our user namespace). Throws std::system_error.
[[nodiscard]] uid_t maker_of(int fd);

}  // namespace arbiter::shm
