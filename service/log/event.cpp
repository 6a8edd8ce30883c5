#include "service/log/event.hpp"

#include "rules/text/names.hpp"

namespace arbiter::service {
namespace {

thread_local const Event* in_hand = nullptr;

}  // namespace

const std::array<EventName, kEventKinds> event_names{{
    {EventKind::kReady, "ready", "8f3968e0860541c885b576654e66ff53"},
    {EventKind::kStopping, "stopping", "cba16e2ffd594facaa99abdf6e283be9"},
    {EventKind::kOpened, "opened", "1dd3351df96645ce88c0e3302a8dbbd6"},
    {EventKind::kClosed, "closed", "90cb838549124a84aa49473d9cfbfc09"},
    {EventKind::kLeft, "left", "f847b9fc4096467d9a16d5dc287bfddc"},
    {EventKind::kDied, "died", "fb7ea130ab934d4eb99393dbaa09fa54"},
    {EventKind::kAway, "away", "fbb867ecdf2e4d52ba7f641973fa80b8"},
    {EventKind::kBack, "back", "1306a6834ad546aaa370f36d1bb083c2"},
    {EventKind::kRefused, "refused", "9dab72e8876a4c119136166872ff9dd6"},
    {EventKind::kTurnedAway, "turned-away", "248d5511328843aea318cc28d2dfc8b5"},
    {EventKind::kGivenUp, "given-up", "8f3862e94b43403f9f4c470665528172"},
    {EventKind::kMismatch, "mismatch", "c67b72bd095444d5b28a764f5e565f16"},
    {EventKind::kUnmentioned, "unmentioned", "81227e76ed73469fba3d8c5d3ab5558c"},
    {EventKind::kBlind, "blind", "c971e9ab352e4050823c067116553326"},
    {EventKind::kDeactivated, "deactivated", "c0df2c441d2b404ca3db4b9cccbd7e4d"},
    {EventKind::kTakeover, "takeover", "4883386fcd20411686863650488cf593"},
    {EventKind::kStarted, "started", "02cbbbcd4e9f46b383bbc8de246ec6e4"},
    {EventKind::kReloaded, "reloaded", "c15531bed0634edf9a9a703188bf82db"},
    {EventKind::kSwitched, "switched", "be722687f4494a3383c78fea3a921a5f"},
    {EventKind::kRolledBack, "rolled-back", "9c297ce3d5a4409db74d0d72ba498835"},
    {EventKind::kChangeRefused, "change-refused", "810b4dbd5ff6480c95704ce6f7da73f1"},
}};

std::string ports_text(const Event& event) {
  const std::size_t count = event.sources.size() + event.ports.size();
  if (count != 1) return rules::counted(count, "port");
  return std::string(event.sources.empty() ? event.ports.front() : event.sources.front());
}

EventScope::EventScope(const Event& event) noexcept : outer_(std::exchange(in_hand, &event)) {}

EventScope::~EventScope() { in_hand = outer_; }

const Event* EventScope::current() noexcept { return in_hand; }

}  // namespace arbiter::service
