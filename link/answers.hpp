// What this link answers when it is asked: by another host's link, or by a program of this host
// through the local socket. A table of verbs, each with a handler.
//
// Handlers run on one thread (the desk's), one at a time, and may wait for the daemon for a second
// at most: whoever asks waits no longer. The same question is handled once, even if it comes twice.
//
// Policy: a local program that asks, whether this link or others through it, needs the verb's
// action at the daemon of its own host. A handler needs what the daemon wants of the link's user.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "link/core/held_tokens.hpp"

namespace arbiter::link {

struct Question {
  std::string host;       // of the link that asks; for a program of this host, this one
  Incarnation asker = 0;  // the life of that link
  std::string verb;
  std::string argument;  // at most kMaxArgument bytes
};

// A document (JSON), or why there is none.
struct Answer {
  bool is_refusal = false;
  std::string text;  // at most kMaxAnswer bytes
};

class Answers {
 public:
  // What it throws (std::exception) is a refusal, too.
  using Handler = std::function<Answer(const Question&)>;

  // Before anybody asks. `action`: the word of the policy (docs/policy.md) for what a local program
  // needs in order to ask it: "observe", "switch".
  void add(const std::string& verb, std::string action, Handler handler);

  [[nodiscard]] Answer answer(const Question& question) const;
  // Null: there is no such verb.
  [[nodiscard]] const std::string* action_of(const std::string& verb) const;

 private:
  struct Verb {
    std::string action;
    Handler handler;
  };
  std::map<std::string, Verb, std::less<>> verbs_;
};

}  // namespace arbiter::link
