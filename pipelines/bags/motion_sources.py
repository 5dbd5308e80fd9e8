"""Sources of the car's motion in a bag: odometry on a topic or in transforms, and a gyroscope."""

from collections import Counter
from functools import partial

from racecar.maps.errors import UserError
from racecar.pipelines.bags.converters.odometry import PoseSource, planar_pose, pose_source, shows_speeds
from racecar.pipelines.bags.converters.registry import ODOMETRY_CONVERTERS, YAW_RATE_CONVERTERS, Converter
from racecar.pipelines.bags.converters.transform_odometry import TransformOdometryConverter
from racecar.pipelines.bags.converters.transforms import FrameLinks, OdometryLinks
from racecar.pipelines.bags.frames import look_at_links, transform_topics
from racecar.pipelines.bags.messages import TRANSFORM_TYPES, frame_name
from racecar.pipelines.bags.samples import Samples, decoded, first_samples
from racecar.pipelines.bags.storage.chunks import BagTopic
from racecar.pipelines.bags.storage.store import BagStore
from racecar.pipelines.bags.topics import choose_imu, choose_odometry
from racecar.sensors.findings import Finding
from racecar.sensors.odometry import Odometry


class MotionSources:
    """The sources that are read, and the links between the frames of the car."""

    def __init__(self, store: BagStore, scans: Samples, findings: list[Finding]) -> None:
        """``scans`` are those of the laser whose motion is wanted. Adds to ``findings``; `open` looks for
        sources."""
        self.odometry: Samples | None = None
        self.odometry_links: OdometryLinks | None = None
        """Links of the odometry if it is in transforms."""
        self.imu: Samples | None = None
        self.tells_of_no_odometry = False
        """Whether a finding reports that no odometry is used, and the consequences."""
        self.left_out_topic: str | None = None
        """Topic of odometry that exists but is not worth reading."""
        self._store, self._findings = store, findings
        self._scan_topic, self._scan_frame = scans.topic.name, scans.frames[0]
        self._integrate_twist = False
        self._named_transforms: BagTopic | None = None

    def open(
        self,
        *,
        odom_topic: str | None,
        use_odometry: bool,
        imu_topic: str | None,
        use_imu: bool,
        is_place_given: bool,
    ) -> FrameLinks:
        """Find the sources; returns the links, if they are needed. Raises UserError when a named topic has no
        motion."""
        source = self._open_odometry(odom_topic) if use_odometry else PoseSource.POSE
        wants_links = source in (PoseSource.NOTHING, PoseSource.STANDING)
        self._open_imu(imu_topic, use_imu)
        needs_links = wants_links or not is_place_given or self.imu is not None
        links = self._look_at_links(wants_links) if needs_links else FrameLinks()
        if wants_links:
            self._open_odometry_links(links, source)
        return links

    def leave_out_odometry(self) -> None:
        """Read no odometry, for the reason that a finding gives."""
        self.left_out_topic = self.odometry.topic.name if self.odometry else None
        self.odometry = self.odometry_links = None
        self.tells_of_no_odometry = True

    def reads_speeds(self) -> bool:
        """Integrate the speeds of the Odometry messages, as a finding reports, since their poses are reset
        again and again; False if they have none, or it is done already."""
        if self.odometry is None or self.odometry_links is not None or self._integrate_twist:
            return False
        topic = self.odometry.topic.name
        self._integrate_twist = shows_speeds(message for _, _, message in decoded(self._store, [topic]))
        if self._integrate_twist:
            self._findings.append(Finding("odometry_resets_by_speeds", topic=topic))
        return self._integrate_twist

    @property
    def odometry_topics(self) -> list[str]:
        """All topics that odometry is read from."""
        of_links = self.odometry_links.topics if self.odometry_links else ()
        return [*([self.odometry.topic.name] if self.odometry else []), *of_links]

    @property
    def odometry_child(self) -> str:
        """The frame that moves; empty if none is named."""
        if self.odometry_links is not None:
            return self.odometry_links.base_frame
        return frame_name(self.odometry.messages[0].child_frame_id) if self.odometry else ""

    def odometry_converter(self, counts: Counter[str]) -> Converter[Odometry]:
        """Converter for the messages on its topics; counts what it corrects."""
        if self.odometry_links is not None:
            return TransformOdometryConverter(self.odometry_links, counts)
        assert self.odometry is not None
        return ODOMETRY_CONVERTERS[self.odometry.topic.message_type](self._integrate_twist, counts)

    def _open_odometry(self, odom_topic: str | None) -> PoseSource:
        """Choose a topic of Odometry messages; returns what shows motion on it."""
        types = (*ODOMETRY_CONVERTERS, *(TRANSFORM_TYPES if odom_topic else ()))
        topic = choose_odometry(self._store.topics, types, odom_topic, self._scan_topic, self._findings)
        if topic is None or topic.message_type in TRANSFORM_TYPES:
            self._named_transforms = topic
            return PoseSource.NOTHING
        samples = first_samples(self._store, topic)
        if not samples.messages:
            return PoseSource.NOTHING
        self.odometry = samples
        source = pose_source(message for _, _, message in decoded(self._store, [topic.name]))
        self._integrate_twist = source == PoseSource.TWIST
        if self._integrate_twist:
            are_poses = any(planar_pose(each) is not None for each in samples.messages)
            name = "odometry_by_speeds" if are_poses else "odometry_without_orientation"
            self._findings.append(Finding(name, topic=samples.topic.name))
        return PoseSource.POSE if odom_topic is not None and source == PoseSource.STANDING else source

    def _open_imu(self, imu_topic: str | None, use_imu: bool) -> None:
        if not use_imu:
            return
        topics, types = self._store.topics, tuple(YAW_RATE_CONVERTERS)
        topic = choose_imu(topics, types, imu_topic, self._scan_topic)
        samples = None if topic is None else first_samples(self._store, topic)
        self.imu = samples if samples and samples.messages else None

    def _look_at_links(self, wants_odometry: bool) -> FrameLinks:
        """Links between the frames of the car that took the scans."""
        frame, found = self._scan_frame, FrameLinks()
        for topics in transform_topics(self._store.topics, self._scan_topic):
            links = look_at_links(topics, partial(decoded, self._store), frame, wants_odometry)
            if links.knows(frame):
                return links
            found = found if found.are_any else links
        return found

    def _open_odometry_links(self, links: FrameLinks, source: PoseSource) -> None:
        """Use odometry from transforms if they show the car moving; otherwise report what there is."""
        found = links.odometry(self._scan_frame)
        if found is not None and found.driving.is_contested and self._named_transforms is None:
            self.tells_of_no_odometry = True
            self._findings.append(
                Finding(
                    "odometry_link_contested",
                    spoils_map=True,
                    link=str(found.driving),
                    topic=found.driving.topic,
                )
            )
            return
        if found is not None and found.driving.moves:
            if source == PoseSource.STANDING and self.odometry is not None:
                self._findings.append(
                    Finding(
                        "odometry_topic_stands",
                        topic=self.odometry.topic.name,
                        link=str(found),
                        link_topics=", ".join(found.topics),
                    )
                )
            self.odometry_links = found
            topic = self._store.topics[found.driving.topic]
            self.odometry = first_samples(self._store, topic, self.odometry_converter(Counter()))
            self._findings += [
                Finding(
                    "odometry_link_stands",
                    link=str(link),
                    topic=link.topic,
                    moving=str(found.driving),
                )
                for link in links.standing_odometry(found)
            ]
            return
        if self._named_transforms is not None:
            raise UserError(
                f"{self._named_transforms.name} holds no link that moves from odometry to the car."
            )
        if source == PoseSource.STANDING:
            return
        self.tells_of_no_odometry = True
        if found is not None:
            self._findings.append(
                Finding("no_odometry_link_moves", link=str(found), topics=", ".join(found.topics))
            )
        else:
            moving = links.solution()
            used = "" if moving is None else f" The link {moving} is another program's solution and not used."
            self._findings.append(Finding("no_odometry", solution=used))
