// What the daemon and its clients say to each other, over a Unix socket that keeps messages apart.
//
// Nothing of it is on the data path: messages carry names and descriptors when ports open and close
// and when models change. A message is plain data of one layout; fields that a kind does not name
// are zero.
//
// A client opens a port:   kOpenOutput / kOpenInput  ->
//                          <- kOpened (or kRefused), kSourcePage…,
//                          kInputPeer… / kOutputPeer…, kConnected
// kConnected says that the peers have mapped the new port too, or were given up waiting for.
// A tap is opened likewise: kOpenTap -> kOpened, kTapSource…, kConnected. For each source the
// daemon asks the component that has it open: kTap -> kTapped (or kPeerRefused).
//
// The daemon changes what a client sees: kSourcePage…, kInputPeer…, then kSync; the client answers
// kSynced when it has taken up all that came before. An output port takes up a peer by writing more
// of its segment; once it has, its receivers hear kOutputGrown.
//
// A client that has lost its daemon looks for another, or the same, and says kHello with kRejoins;
// it is answered kWelcome (or kRefused) and tells what it has: kHandBackPage…, for each port
// kHandBackOutput or kHandBackInput with its kHandBackLink…, and then kHandedBack. A node that ends
// says kNodeEnded; where no daemon reads it the other nodes of its process tell the next one.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"
#include "shm/type_info.hpp"

namespace arbiter::wire {

inline constexpr std::uint32_t kWireVersion = 6;

enum class MessageKind : std::uint32_t {
  // From a client.
  kHello = 1,    // name, flags (kHasServiceThread, kComesBack, kRejoins, kHasNoPorts); value =
                 // kWireVersion; link: the node it was welcomed as before, or 0; if it rejoins,
                 // descriptors: board, registry
  kOpenOutput,   // name, type, flags (kYields); descriptor: its segment
  kOpenInput,    // name, type; descriptors: its segment, its bell
  kClosePort,    // port
  kSynced,       // request: that of the kSync
  kStatus,       // ask for a status document
  kDeactivate,   // name: a source whose process is gone
  kObserve,      // send every page and every port name, now and as they come
  kPeerRefused,  // port, peer, text: the client could not take up a peer, for status
  kReload,       // read the files again; kDone (value: the generation) once they are in force.
                 // flags: kWantsReport, kDryRun (with it), kGoesBack (link: as kRollback)
  kStop,         // kDone, and then the daemon ends
  kSwitch,       // name: a model that is loaded; kDone (value: the generation) in force
  kRollback,     // link: a generation of the history, 0: the one before; as kReload
  kHandBackPage = 40,  // id, value: its number; descriptor: an activity page of a source
  kHandBackOutput,     // port, id = source, type, flags (kYields); descriptors: its segment, its
                       // page
  kHandBackInput,      // port, id = port id, type; descriptors: its segment, its bell
  kHandBackLink,       // port, peer; link: its number, 0 if not connected
  kHandedBack,         // that was all
  kConnect,  // port: opened by a daemon that has gone since; asks for the kConnected that is
             // missing
  kModel,    // ask for the texts of the model in force
  kBlind,    // port, text: it cannot see a source that its rules read, for the log
  kOpenTap,  // name, flags (kTapsInput, kRejoins); descriptors: its segment, its bell. kOpened and
  // kConnected as for a port; it is closed as one. One that another daemon has opened asks
  // again
  kTapped,     // answers kTap. port, peer; link, value: where the tap reads; descriptor: the events
  kDescribe,   // port, text: what stands behind it, for the status; empty: nothing. value: 1 where
               // something is wrong with it
  kMay = 60,   // value: a user; text: its groups, numbers between blanks; name: an action that is
               // about no port. kDone: the policy allows it; kRefused, text: why not
  kNodeEnded,  // link: the node itself, or one of its process that may have ended unheard

  // From the daemon.
  kWelcome = 100,  // link: the node's number; peer: the daemon's clock, 0 if it does not say;
                   // descriptors: the board, the registry, read-only
  kOpened,         // port: its instance; id: its source or port id; of an output port also flags
                   // (kMayReplay), text: why not; descriptor: its page
  kConnected,
  kRefused,       // text: why
  kSourcePage,    // id, name: a source; value: the number of its page, in force or to come;
                  // descriptor: the page, read-only
  kPortName,      // id, name: an input port
  kOutputPeer,    // to input `port`: peer, id = source, link; descriptor: its segment
  kInputPeer,     // to output `port`: peer, id = port id, flags (kIsConnected), link; descriptors:
                  // segment, bell
  kPeerGone,      // `port` has lost `peer`: closed or dead. To a tap, of an output port: flags
                  // (kTellsActivity), link: the word of its source's activity; peer is 0 where this
                  // daemon never knew it, id: the source
  kDisconnected,  // `port` is no longer connected to `peer`, which lives: the model has changed
  kSync,
  kStatusReply,  // descriptor: a memfd with JSON
  kDone,
  kOutputGrown,        // to input `port`: `peer` uses more of its segment now
  kReport,             // in place of kDone and kRefused; descriptor: a memfd with JSON
  kModelReply,         // descriptor: a memfd with JSON
  kConnectionRefused,  // `port` is not connected to `peer`, though the model says so, and is not to
                       // be; id = source, or port id; name: the peer's; text: why
  kUnmentioned,        // port, text: the model in force does not mention it
  kTap,        // to output `port`: tap `peer` watches it; flags (kIsPrivileged), else value: its
               // user; descriptors: the tap's segment, its bell
  kTapAway,    // to output `port`: the conversation with tap `peer` is lost, its process lives
  kTapSource,  // to tap `port`: peer, id = source, name; link, value: of kTapped; descriptors: the
               // segment of the output port, its events
  kTapInput,   // to tap `port` of an input port: peer has that open, name; descriptor: its segment
  kMeasure,    // to input `port`, which is tapped: value 1: count how long samples wait; 0: no more
  kYield,      // to output `port`, which yields: a component asks for its name, once; text: which
  kModelInForce,  // to an observer: link: the generation of the model that is in force now, and at
                  // each change; of several the last
};

enum MessageFlag : std::uint32_t {
  kHasServiceThread = 1,
  kIsConnected = 2,      // else the input port only senses the output port
  kComesBack = 4,        // the client will rejoin if the conversation is lost
  kRejoins = 8,          // it does so now; or the tap was opened by another daemon
  kWantsReport = 16,     // of a change of the model: kReport is the answer, whatever comes of it
  kDryRun = 32,          // of a reload: only say what it would do; of a switch: whether it would be
  kMayReplay = 64,       // the output port may be given times of arrival (Action::kReplay)
  kTapsInput = 128,      // the tap is of an input port: of all sources that are connected to it
  kIsPrivileged = 256,   // the tap is root's, or of the daemon's own user
  kTellsActivity = 512,  // else the daemon does not know it
  kYields = 1024,        // the output port gives way to one of its name that does not
  kHasNoPorts = 2048,    // who rejoins is a newcomer to a daemon that has other memory
  kGoesBack = 4096,      // of a dry run: say what a rollback would do, and not a reload
};

struct Message {
  MessageKind kind = MessageKind::kHello;
  std::uint32_t flags = 0;
  std::uint64_t request = 0;   // a reply bears that of its question
  shm::PortInstance port = 0;  // of the receiver of the message
  shm::PortInstance peer = 0;
  std::uint64_t link = 0;  // number of the link; another each time that two ports are connected
  std::uint32_t id = 0;
  std::uint32_t value = 0;
  shm::TypeInfo type;
  char name[shm::kMaxNameLength + 1] = {};
  char text[1024] = {};

  [[nodiscard]] std::string_view name_view() const noexcept {
    return {name, strnlen(name, shm::kMaxNameLength)};
  }
  [[nodiscard]] std::string_view text_view() const noexcept {
    return {text, strnlen(text, sizeof text - 1)};
  }
  void set_name(std::string_view value_text) noexcept { copy(value_text, name, sizeof name); }
  void set_text(std::string_view value_text) noexcept { copy(value_text, text, sizeof text); }

 private:
  static void copy(std::string_view from, char* to, std::size_t capacity) noexcept {
    std::size_t length = from.size() < capacity - 1 ? from.size() : capacity - 1;
    // What is cut off is cut off between two characters.
    while (length != 0 && length < from.size() &&
           (static_cast<unsigned char>(from[length]) & 0xc0) == 0x80) {
      --length;
    }
    if (length != 0) std::memcpy(to, from.data(), length);  // an empty view may point nowhere
    to[length] = '\0';
  }
};

inline constexpr std::size_t kMaxDescriptors = 2;

// What the kernel lets one message carry (SCM_MAX_FD).
inline constexpr std::size_t kMostDescriptorsOfAMessage = 253;

struct Received {
  Message message;
  std::array<shm::FileDescriptor, kMaxDescriptors> descriptors;
  std::size_t descriptor_count = 0;
  bool lost_descriptors = false;  // this process had no descriptor left for one that came
  bool is_strange = false;        // the daemon's word: one of them is nothing that is taken
  // Those beyond what a message may carry: it is malformed, and who received it disposes of them.
  std::array<shm::FileDescriptor, kMostDescriptorsOfAMessage - kMaxDescriptors> surplus{};
};

// kTooMany: this user has as many descriptors under way, to whomever, as it may.
enum class SendResult { kSent, kFull, kTooMany, kClosed };
enum class ReceiveResult { kReceived, kNothing, kClosed, kMalformed };

// What a call may wait at a socket that blocks, in seconds.
inline constexpr int kMaxWaitToSend = 1;

// Non-blocking unless the socket blocks; signals that interrupt it make that three times
// kMaxWaitToSend at most.
// Never raises SIGPIPE. What is received is all that came:
// descriptors that the kernel finds no room for, it closes before recvmsg() returns, and to close a
// stranger's may block. So there is room for as many as there can be.
[[nodiscard]] SendResult send_message(int socket, const Message& message,
                                      std::array<int, kMaxDescriptors> descriptors = {-1,
                                                                                      -1}) noexcept;
[[nodiscard]] ReceiveResult receive_message(int socket, Received& received, bool wait) noexcept;

}  // namespace arbiter::wire
