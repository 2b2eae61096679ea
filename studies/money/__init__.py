"""Money: present value of later savings, and the best purchase for a sum."""
