// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/report_views.h"

#include "app/batch/campaigns/sphere_map.h"
#include "common/core/text.h"
#include "common/targets/target.h"
#include "evaluation/report/view_angles.h"

namespace berth::campaigns {

Quaterniond upright_attitude(const Vector3d& on_map) {
  const Vector3d boresight = -direction_in_model(on_map).normalized();
  // Seen along y there is no upright: z of the model is as good as any.
  const Vector3d down =
      std::abs(boresight.y()) > 0.999 ? Vector3d(0, 0, boresight.y()) : Vector3d(0, 1, 0);
  const Vector3d y = (down - down.dot(boresight) * boresight).normalized();
  Matrix3d rotation;
  rotation.row(0) = y.cross(boresight);
  rotation.row(1) = y;
  rotation.row(2) = boresight;
  return Quaterniond(rotation);
}

report::Html views_of(const CampaignTarget& seen, const std::vector<NamedDirection>& directions) {
  if (directions.empty()) return {};
  const Target target = load_target(seen.place, seen.length);
  const RayCaster caster(target.mesh);
  const double away = 2.5 * caster.bounds().size().maxCoeff();
  report::Html html;
  for (const NamedDirection& one : directions) {
    const Pose pose{{0, 0, away}, upright_attitude(one.on_map)};
    report::AngleBox box = report::angles_of(caster.bounds(), pose);
    box.widen(0.04);
    const report::View view = report::view_of(box);
    html += report::markup("<figure class=\"scan\"><figcaption>") + report::text(one.caption) +
            report::markup("</figcaption><svg viewBox=\"0 0 " + fixed(view.width, 0) + " " +
                           fixed(view.height, 0) + "\" role=\"img\">" +
                           report::shaded(caster, pose, view) + "</svg></figure>\n");
  }
  return report::element("div", "grid fill", html);
}

}  // namespace berth::campaigns
