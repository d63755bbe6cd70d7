//! Pictures and the pinhole.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use approx::assert_relative_eq;
use hw_traits::picture::{Intrinsics, NotRows, Picture};
use proptest::prelude::*;

#[test]
fn a_picture_is_whole_rows_and_nothing_else() {
    let picture = Picture::new(3, vec![0, 1, 2, 3, 4, 5]).unwrap();
    assert_eq!((picture.width(), picture.height()), (3, 2));
    assert_eq!(picture.get(1, 0), Some(&3));
    assert_eq!((picture.get(0, 3), picture.get(2, 0)), (None, None));
    assert_eq!(Picture::new(3, vec![0; 4]), Err(NotRows { width: 3, pixels: 4 }));
    assert_eq!(Picture::new(0, vec![0; 4]), Err(NotRows { width: 0, pixels: 4 }));
    assert_eq!(Picture::<u8>::new(3, vec![]), Err(NotRows { width: 3, pixels: 0 }));
}

#[test]
fn what_is_behind_the_lens_is_not_seen() {
    let pinhole = Intrinsics { fx: 600.0, fy: 600.0, cx: 320.0, cy: 240.0 };
    assert_eq!(pinhole.pixel([0.1, 0.1, 0.0]), None);
    assert_eq!(pinhole.pixel([0.1, 0.1, -1.0]), None);
    assert_eq!(pinhole.pixel([0.0, 0.0, 2.0]), Some((320.0, 240.0)));
    // A metre to the right at a depth of two is half a focal length off the middle.
    assert_eq!(pinhole.pixel([1.0, 0.0, 2.0]), Some((620.0, 240.0)));
}

proptest! {
    #[test]
    fn a_pixel_and_its_point_belong_together(u in 0.0..640.0, v in 0.0..480.0, depth in 0.01..10.0) {
        let pinhole = Intrinsics { fx: 615.0, fy: 612.0, cx: 318.5, cy: 241.5 };
        let (back_u, back_v) = pinhole.pixel(pinhole.point(u, v, depth)).unwrap();
        assert_relative_eq!(back_u, u, epsilon = 1e-9);
        assert_relative_eq!(back_v, v, epsilon = 1e-9);
    }
}
