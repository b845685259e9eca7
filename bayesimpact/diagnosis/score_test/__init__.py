"""What every effect would explain at best, without a refit."""
