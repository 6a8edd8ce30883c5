#include "captions.hpp"

#include <algorithm>
#include <array>

namespace search_and_track {
namespace {

// Winners at several ports change one after the other; only what stays is worth a sentence.
constexpr double kSettled = 0.1;

struct Explanation {
  Winner gaze_before;
  Winner gaze;
  Winner arm;
  const char* what;
  const char* why;
};

// By what the gaze did: the paper's scene has no two changes of it that look the same.
constexpr std::array<Explanation, 7> kExplanations{{
    {kNotYetKnown, kRandomLook, kRestArm,
     "Nothing is in sight: Look Around moves the gaze, Rest Arm parks the arm.",
     "No other source is active, so nobody inhibits these two."},
    {kRandomLook, kFace, kRestArm, "A face appeared: Follow Face inhibits Look Around.",
     "Random Look sends on as before; at /Gaze/pos:i its samples are discarded."},
    {kFace, kObject, kObject, "An object appeared: Track Object takes gaze and arm.",
     "It inhibits Rest Arm, and Be Curious: that is Look Around and Follow Face."},
    {kObject, kNobody, kNobody, "A collision: Track Object must not run, and both motors stop.",
     "The object is still seen, though, and still inhibits everybody else."},
    {kNobody, kObject, kObject, "The collision is over: Track Object takes both again.",
     "An activity ends 500 ms after the last that was heard of its source."},
    {kObject, kFace, kRestArm, "The object is gone: Follow Face and Rest Arm are free again.",
     "The face was there all the time; only the inhibition had to end."},
    {kFace, kRandomLook, kRestArm, "The face is gone: everything has fallen back.",
     "Look Around and Rest Arm command again, as in the beginning."},
}};

std::string commander(Winner winner) {
  if (winner == kNobody) return "nobody";
  if (winner == kNotYetKnown) return "nobody yet";
  return std::string(kSenders[winner].name);
}

Caption facts(Winner gaze, Winner arm, const Story& story) {
  std::string senders;
  for (std::size_t i = 0; i < kSenders.size(); ++i) {
    if (!story.sender(i).sends) continue;
    senders += senders.empty() ? "" : ", ";
    senders += kSenders[i].name;
  }
  return {commander(gaze) + " commands the gaze, " + commander(arm) + " the arm.",
          "Sending: " + senders + "."};
}

}  // namespace

const Caption& Captions::at(const Story& story, double now) {
  const Winner gaze = story.receiver(kGaze).winner();
  const Winner arm = story.receiver(kArm).winner();
  const bool settled = now - story.last_change() >= kSettled;
  if (!settled || gaze == kNotYetKnown || arm == kNotYetKnown) return caption_;
  if (!papers_model_) return caption_ = facts(gaze, arm, story);
  if (gaze == gaze_ && arm == arm_) return caption_;
  const auto* const found =
      std::find_if(kExplanations.begin(), kExplanations.end(), [&](const Explanation& explanation) {
        return explanation.gaze_before == gaze_ && explanation.gaze == gaze &&
               explanation.arm == arm;
      });
  caption_ =
      found == kExplanations.end() ? facts(gaze, arm, story) : Caption{found->what, found->why};
  gaze_ = gaze;
  arm_ = arm;
  return caption_;
}

}  // namespace search_and_track
