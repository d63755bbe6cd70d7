/// Implements a trait for `&mut T` and `Box<T>` of every `T` that has it, trait objects among them; the items are written once, in terms of `T`.
macro_rules! forward {
    ($Trait:ident { $($items:tt)* }) => {
        impl<T: $Trait + ?Sized> $Trait for &mut T { $($items)* }
        impl<T: $Trait + ?Sized> $Trait for Box<T> { $($items)* }
    };
}

pub(crate) use forward;
