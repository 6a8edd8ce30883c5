// Notices: what a component should know of its ports, and does not see by its own calls.
//
// They are collected while messages are handled, under the lock, and given afterwards, under none,
// before the next message is handled: so a port's opening returns after what was known of it.
#include <cstdio>

#include "client/node/node_core.hpp"

namespace arbiter::detail {
namespace {

// Texts that are kept of one port, lest they be given twice.
constexpr std::size_t kMaxTexts = 64;
// Notices that wait because a callback is slow; what comes then is lost.
constexpr std::size_t kMaxNotices = 1024;

}  // namespace

const std::string& NodeCore::name_of_port(shm::PortInstance port) const {
  static const std::string& none = *new std::string;  // outlives static nodes
  if (const auto output = outputs_.find(port); output != outputs_.end()) {
    return output->second->name();
  }
  if (const auto tap = taps_.find(port); tap != taps_.end()) return tap->second->name();
  const auto input = inputs_.find(port);
  return input != inputs_.end() ? input->second->name() : none;
}

void NodeCore::note(NoticeKind kind, shm::PortInstance port, const std::string& peer,
                    const std::string& text) {
  std::set<std::string>& texts = given_[port];
  if (texts.size() >= kMaxTexts || notices_.size() >= kMaxNotices) return;
  if (texts.insert(text).second) notices_.push_back({kind, name_of_port(port), peer, text});
}

bool NodeCore::give_notices() {
  std::unique_lock lock(mutex_);
  if (notices_.empty() || is_giving_) return false;
  is_giving_ = true;
  while (!notices_.empty()) {
    const std::vector<Notice> notices = std::exchange(notices_, {});
    lock.unlock();
    for (const Notice& notice : notices) give(notice);
    lock.lock();
  }
  is_giving_ = false;
  return true;
}

void NodeCore::give(const Notice& notice) const noexcept {
  if (!options_.on_notice) {
    std::fprintf(stderr, "arbiter: \"%s\": %s\n", name_.c_str(), notice.text.c_str());
    return;
  }
  try {
    options_.on_notice(notice);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "arbiter: \"%s\": on_notice has thrown: %s\n", name_.c_str(),
                 error.what());
  } catch (...) {
    std::fprintf(stderr, "arbiter: \"%s\": on_notice has thrown\n", name_.c_str());
  }
}

// Of a peer that the daemon has announced and that we cannot take up. Tells the daemon, so that it
// shows in its status, and the other end.
void NodeCore::refuse_peer(const wire::Message& announced, const std::string& why) {
  const std::lock_guard lock(mutex_);
  say_refused(announced.port, announced.peer, why);
  const auto input = inputs_.find(announced.port);
  const bool is_output_peer = announced.kind == wire::MessageKind::kOutputPeer;
  if (is_output_peer && input != inputs_.end()) {
    input->second->refuse_peer(announced.peer, announced.id);
  }
  const auto output = outputs_.find(announced.port);
  const bool is_to_connect = is_output_peer || (announced.flags & wire::kIsConnected) != 0;
  if (is_to_connect && output != outputs_.end()) {
    output->second->refuse_peer(announced.peer, announced.id, announced.name_view());
  }
  if (is_to_connect) note_refusal(announced, why);
}

// Of an input port that waited for a queue.
void NodeCore::refuse_waiting(shm::PortInstance port, const InputPeer& peer,
                              const std::string& why) {
  say_refused(port, peer.instance, why);
  wire::Message about;
  about.port = port;
  about.set_name(peer.name);
  note_refusal(about, why);
}

void NodeCore::say_refused(shm::PortInstance port, shm::PortInstance peer, const std::string& why) {
  wire::Message refusal;
  refusal.kind = wire::MessageKind::kPeerRefused;
  refusal.port = port;
  refusal.peer = peer;
  refusal.set_text(why);
  say(refusal);
}

void NodeCore::note_refusal(const wire::Message& about, const std::string& why) {
  const std::string& own = name_of_port(about.port);
  if (own.empty()) return;  // closed meanwhile
  const std::string peer(about.name_view());
  const bool is_output = outputs_.count(about.port) != 0;
  const std::string& from = is_output ? own : peer;
  const std::string& to = is_output ? peer : own;
  note(NoticeKind::refused, about.port, peer, from + " is not connected to " + to + ": " + why);
}

void NodeCore::say_blind(shm::PortInstance port, const char* what_it_does) {
  const std::string text = name_of_port(port) + " " + what_it_does +
                           " while it cannot see all sources that its rules read";
  note(NoticeKind::blind, port, {}, text);
  wire::Message message;
  message.kind = wire::MessageKind::kBlind;
  message.port = port;
  message.set_text(text);
  say(message);
}

// A refusal that the daemon or the peer has found.
void NodeCore::handle_refusal(const wire::Message& refusal) {
  const std::lock_guard lock(mutex_);
  if (note_tap_refusal(refusal)) return;
  if (const auto output = outputs_.find(refusal.port); output != outputs_.end()) {
    output->second->refuse_peer(refusal.peer, refusal.id, refusal.name_view());
  }
  if (const auto input = inputs_.find(refusal.port); input != inputs_.end()) {
    input->second->refuse_peer(refusal.peer, refusal.id);
  }
  note_refusal(refusal, std::string(refusal.text_view()));
}

void NodeCore::handle_unmentioned(const wire::Message& message) {
  const std::lock_guard lock(mutex_);
  if (name_of_port(message.port).empty()) return;  // closed meanwhile
  note(NoticeKind::unmentioned, message.port, {}, std::string(message.text_view()));
}

void NodeCore::handle_yield(const wire::Message& message) {
  const std::lock_guard lock(mutex_);
  const auto output = outputs_.find(message.port);
  if (output == outputs_.end() || !output->second->yields()) return;
  output->second->ask_to_yield();
  note(NoticeKind::asked_to_yield, message.port, {},
       output->second->name() + " is asked to yield to " + std::string(message.text_view()));
}

}  // namespace arbiter::detail
