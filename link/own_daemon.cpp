#include "link/own_daemon.hpp"

#include <unistd.h>

#include <chrono>

#include "wire/call.hpp"
#include "wire/document.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::link {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAnswerTime{1000};

wire::Call call(const std::string& instance) {
  wire::Caller caller;
  caller.name = "arbiter-link-desk";
  caller.instance = wire::instance_name(instance);
  caller.patience = milliseconds(1);
  caller.answer_time = kAnswerTime;
  return wire::Call(caller);
}

std::string document_of(const std::string& instance, wire::MessageKind kind) {
  wire::Message question;
  question.kind = kind;
  return wire::read_document(call(instance).ask(question, kAnswerTime).descriptors[0]);
}

}  // namespace

std::string OwnDaemon::status() const { return document_of(instance_, wire::MessageKind::kStatus); }

std::string OwnDaemon::model() const { return document_of(instance_, wire::MessageKind::kModel); }

void OwnDaemon::require(const LocalUser& who, const std::string& action) const {
  wire::Message question;
  question.kind = wire::MessageKind::kMay;
  question.value = who.user;
  question.set_name(action);
  std::string groups;
  for (const gid_t group : who.groups) {
    groups += (groups.empty() ? "" : " ") + std::to_string(group);
  }
  if (groups.size() >= sizeof question.text) {
    throw wire::RefusedError("you are in more groups than the daemon can be asked about");
  }
  question.set_text(groups);
  try {
    static_cast<void>(call(instance_).ask(question, kAnswerTime));
  } catch (const wire::RefusedError&) {
    throw;
  } catch (const wire::CallError& error) {
    if (who.user == 0 || who.user == ::geteuid()) return;
    throw wire::RefusedError(std::string("the policy is not known: ") + error.what());
  }
}

}  // namespace arbiter::link
