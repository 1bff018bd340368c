// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/answered.h"

#include <nlohmann/json.hpp>

namespace tendon::softbody {
namespace {

struct AnswerCount {
  std::string key;
  int count;
  std::string words;
};

std::vector<AnswerCount> counts_of(const Answered& answered) {
  std::vector<AnswerCount> counts;
  for (const FallbackModel::Step& step : answered.levels) {
    const std::string name(step.size.name);
    counts.push_back({name, step.answers, "answers were " + name});
  }
  if (const auto& near = answered.near) {
    counts.push_back({"linear", near->linear, "answers were from the linear body"});
    counts.push_back({"fields", near->made - 1 + near->late, "near fields were computed by the other thread"});
    counts.push_back({"fields_late", near->late, "of them were too late"});
  }
  return counts;
}

}  // namespace

std::string in_words(const Answered& answered) {
  std::string text;
  for (const auto& [key, count, words] : counts_of(answered)) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + ' ' + words;
  }
  return text.empty() ? text : text + '\n';
}

std::string in_json(const Answered& answered) {
  nlohmann::ordered_json counts;
  for (const auto& [key, count, words] : counts_of(answered)) counts[key] = count;
  if (counts.empty()) return {};
  return nlohmann::ordered_json{{"answers", std::move(counts)}}.dump() + '\n';
}

}  // namespace tendon::softbody
