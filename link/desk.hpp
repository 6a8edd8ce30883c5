// Where this link is asked, and asks: it knows the other links, answers them and the programs of
// this host, and carries questions of these to other hosts.
//
// It shows and says; it changes nothing that is decided. Whatever others send, and however long the
// daemon takes to answer, the link's loop and its samples do not wait for it.
//
// Thread safety: look() and join() on the link's thread. Messages are heard on Cyclone's threads,
// programs are served on threads of their own (link/local_socket.hpp), questions are answered on
// one more. mutex_ guards what they share, and is held while nothing waits. send_mutex_ is held
// while a question is numbered and sent; topics_mutex_ while topics are used, so that they stay.
// Who takes several takes send_mutex_ first and mutex_ last.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <string>
#include <thread>
#include <vector>

#include "gateway/core/bridge.hpp"
#include "gateway/dds/quota.hpp"
#include "link/answers.hpp"
#include "link/core/asked_questions.hpp"
#include "link/core/disagreements.hpp"
#include "link/core/neighbours.hpp"
#include "link/core/offers.hpp"
#include "link/core/pulse.hpp"
#include "link/core/questions.hpp"
#include "link/dds/message_topic.hpp"
#include "link/dds/network.hpp"
#include "link/local_socket.hpp"
#include "link/own_daemon.hpp"
#include "link/switching.hpp"
#include "link/token_clock.hpp"
#include "wire/hosts.hpp"

namespace arbiter::link {

struct DeskTopics;

// What the link's loop knows of its own host.
struct OwnHost {
  HostCard card;  // but for who this link is
  std::vector<wire::ImportStatus> imports;
  std::string waits_for;  // empty: for nothing
};

class Desk {
 public:
  // `me`: who this link is: host, instance, version, incarnation. `known`: whom it has known in an
  // earlier life.
  Desk(HostCard me, Neighbours known);
  Desk(const Desk&) = delete;
  Desk& operator=(const Desk&) = delete;
  ~Desk();

  // From now on other links are known. `network`: what to call it. Keeps a reference to `bell`,
  // which rings when links come and go. Throws DdsError.
  void join(const Network& network, std::string name, const gateway::Bell& bell);
  // The network goes: nobody is heard, or asked, until join() is called again.
  void leave();
  // The last call: nobody can ask any more, and nobody else is asked. Does not wait; the destructor
  // closes first where nobody has, and waits for the daemon, for those who have asked, for some
  // seconds at most.
  void close();
  // Takes up what has changed, here and elsewhere, and logs what hosts do not agree upon. Ten times
  // a second.
  void look(OwnHost own);

  // Of those that are there: who does not hear this link, and what each has said last.
  [[nodiscard]] OtherLinks others() const;
  // After close(): those that it knew, gone now.
  [[nodiscard]] Neighbours known() const;

  // Of this host, to which verbs may be added before anybody can ask: see add_verbs().
  [[nodiscard]] Answers& answers() noexcept { return answers_; }

 private:
  void add_verbs();
  void open_socket();
  void send_card();
  void look_at_others();
  void look_who_is_there(shm::Nanoseconds now);
  void compare_with_others(shm::Nanoseconds now);
  void say_without_place(std::size_t count);
  void say_deaf(const std::set<std::string>& hosts);
  void say_who_is_there(const std::set<std::string>& hosts);

  // On Cyclone's threads.
  void hear_card(Bytes message, const gateway::dds::SampleWriter& writer);
  void hear_pulse(Bytes message, const Participant& from);
  void hear_question(Bytes message, std::uint64_t writer);
  void hear_answer(Bytes message, const Participant& from);

  // On the answering thread.
  void answer_questions();
  void answer(Asked asked);

  // On threads of programs.
  std::string serve(const LocalUser& who, const wire::LinkQuestion& question);
  std::vector<wire::HostAnswer> ask_hosts(const wire::LinkQuestion& question);
  // Waits, for a lease at most, until those that are there have been heard. Throws
  // std::runtime_error where there is no network, or not all are known.
  void await_all_hosts();
  // Nobody hears it while there is no network.
  void send_question(const QuestionMessage& message);
  // False: it could not be sent now.
  bool send_answer(const AnswerMessage& message);
  // Under send_mutex_ alone.
  void put_question(const QuestionMessage& message);
  // Asks again those who do not answer, until their time is over.
  OpenQuestions::Replies await_replies(QuestionMessage& message);

  [[nodiscard]] wire::HostsDocument document() const;

  const HostCard me_;
  const shm::Nanoseconds began_;
  const OwnDaemon daemon_;
  Switching switching_;  // of the answering thread
  Answers answers_;

  std::mutex send_mutex_;
  std::shared_mutex topics_mutex_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Never null, and set by the link's thread alone.
  std::shared_ptr<const OwnHost> own_ = std::make_shared<OwnHost>();
  std::string network_;  // empty: not joined
  shm::Nanoseconds joined_ = 0;
  Neighbours neighbours_;
  RoundTrips round_trips_;
  Disagreements disagreements_;  // of the link's thread
  // As that has found last; never null.
  std::shared_ptr<const std::vector<Disagreement>> standing_ =
      std::make_shared<std::vector<Disagreement>>();
  OpenQuestions open_;
  AskedQuestions asked_;
  bool closes_ = false;  // answers of others are not awaited any more
  bool ends_ = false;

  // Of the link's thread.
  std::shared_ptr<const OwnHost> sent_;  // whose card was sent last; null: it has to be sent
  std::uint64_t compared_changes_ = 0;
  bool is_without_place_said_ = false;
  std::set<std::string> deaf_said_;
  std::set<std::string> there_said_;
  gateway::dds::Quota presences_{100, 100'000'000'000};  // of lines about who comes and goes
  shm::Nanoseconds compare_until_ = 0;
  shm::Nanoseconds compare_again_ = 0;
  shm::Nanoseconds send_again_ = 0;
  shm::Nanoseconds open_again_ = 0;
  std::string said_;

  // Destroyed in reverse: callers go before what they call.
  std::unique_ptr<DeskTopics> topics_;
  std::thread answering_;
  std::unique_ptr<TokenClock> pulse_;
  std::unique_ptr<LocalSocket> socket_;
};

}  // namespace arbiter::link
